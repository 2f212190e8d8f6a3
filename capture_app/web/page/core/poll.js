// Look again and again until the view is left.
import { ApiError } from "./api.js";

/** Wait; ends early, with an AbortError, when the signal is raised.
 *  @param {number} milliseconds @param {AbortSignal} [signal] @returns {Promise<void>} */
export function rest(milliseconds, signal) {
  return new Promise((resolve, reject) => {
    if (signal?.aborted) {
      reject(signal.reason);
      return;
    }
    const timer = setTimeout(resolve, milliseconds);
    signal?.addEventListener("abort", () => (clearTimeout(timer), reject(signal.reason)), { once: true });
  });
}

/** Call `look` until it returns true or the signal is raised; a server that is away is waited for,
 *  any other error goes to `failed` and ends it.
 *  @param {() => Promise<unknown>} look @param {number} milliseconds @param {AbortSignal} signal
 *  @param {(error: unknown) => void} failed */
export async function poll(look, milliseconds, signal, failed) {
  while (!signal.aborted) {
    try {
      if (await look()) return;
    } catch (error) {
      if (signal.aborted) return;
      if (!(error instanceof ApiError && error.offline)) {
        failed(error);
        return;
      }
    }
    // A tab that nobody sees asks less often.
    const pause = document.hidden ? 4 * milliseconds : milliseconds;
    await rest(pause, signal).catch(() => {});
  }
}
