// Stands in for the server: `fetch` as the page calls it, answered by a test.

/** Until the test is over, `answer(path, options)` gives {status, body} or throws.
 *  Returns the calls. */
export function served(t, answer) {
  const calls = [];
  t.mock.method(globalThis, "fetch", async (path, options = {}) => {
    calls.push({ path, ...options });
    options.signal?.throwIfAborted();
    const { status = 200, body = null } = await answer(path, options);
    const text = typeof body === "string" || body === null ? body : JSON.stringify(body);
    return new Response(text, { status });
  });
  return calls;
}
