import assert from "node:assert/strict";
import test from "node:test";

import { ApiError, api, bytes, connection, inWords } from "../../capture_app/web/page/core/api.js";
import { served } from "./served.js";

test("without a body it is asked for, with one it is sent as JSON", async (t) => {
  const calls = served(t, () => ({ body: { good: true } }));
  assert.deepEqual(await api("/api/a"), { good: true });
  await api("/api/b", { json: { x: 1 }, headers: { "Idempotency-Key": "k" } });
  assert.equal(calls[0].method, "GET");
  assert.equal(calls[1].method, "POST");
  assert.equal(calls[1].body, '{"x":1}');
  assert.deepEqual(calls[1].headers, {
    "Content-Type": "application/json",
    "Idempotency-Key": "k",
  });
});

test("an answer without content is null", async (t) => {
  served(t, () => ({ status: 204 }));
  assert.equal(await api("/api/a", { method: "DELETE" }), null);
});

test("a refusal says what, where, how to mend it, and what else is told", async (t) => {
  const error = { code: "disk-full", what: "The disk is full.", where: "here", fix: "Make room." };
  served(t, () => ({ status: 507, body: { error: { ...error, received: 7 } } }));
  await assert.rejects(api("/api/a"), (told) => {
    assert.ok(told instanceof ApiError);
    const { status, code, what, where, fix, rest } = told;
    assert.deepEqual({ code, what, where, fix }, error);
    assert.equal(status, 507);
    assert.equal(rest.received, 7);
    return true;
  });
});

test("an answer that is no JSON of ours is told by its number", async (t) => {
  served(t, () => ({ status: 502, body: "<html>" }));
  await assert.rejects(bytes("/api/scene"), { status: 502, code: "http-502" });
});

test("a server that is away is told once, and again when it is back", async (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  let away = true;
  served(t, () => {
    if (away) throw new TypeError("Failed to fetch");
    return { body: [] };
  });
  const heard = [];
  for (const kind of ["lost", "back"]) connection.addEventListener(kind, () => heard.push(kind));
  await assert.rejects(api("/api/a"), { offline: true, code: "offline" });
  await assert.rejects(api("/api/a"), { offline: true });
  assert.deepEqual(heard, ["lost"]);
  away = false;
  await api("/api/a");
  await api("/api/a");
  assert.deepEqual(heard, ["lost", "back"]);
});

test("who left is not told that the server is away", async (t) => {
  served(t, () => ({}));
  const left = AbortSignal.abort();
  await assert.rejects(api("/api/a", { signal: left }), { name: "AbortError" });
});

test("any error has words", () => {
  const known = new ApiError(404, { code: "gone", what: "It is gone." });
  assert.equal(inWords(known), known);
  const told = inWords(new RangeError("too far"));
  assert.equal(told.where, "too far");
  assert.ok(told.what && told.fix);
  assert.equal(inWords("odd").where, "odd");
});
