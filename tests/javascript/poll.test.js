import assert from "node:assert/strict";
import test from "node:test";

import { ApiError } from "../../capture_app/web/page/core/api.js";
import { poll, rest } from "../../capture_app/web/page/core/poll.js";

const OFFLINE = new ApiError(0, { code: "offline", what: "omocap does not answer." });
globalThis.document ??= { hidden: false };

/** Looks that end one after the other as told: a value, or an error that is thrown. */
function looks(...ends) {
  const look = async () => {
    look.times += 1;
    const end = ends.shift();
    if (end instanceof Error) throw end;
    return end;
  };
  look.times = 0;
  return look;
}

test("it is looked until there is nothing more to see", async () => {
  const look = looks(false, undefined, true, true);
  await poll(look, 1, new AbortController().signal, assert.fail);
  assert.equal(look.times, 3);
});

test("a server that is away is waited for", async () => {
  const look = looks(OFFLINE, OFFLINE, true);
  await poll(look, 1, new AbortController().signal, assert.fail);
  assert.equal(look.times, 3);
});

test("any other error is told once and ends it", async () => {
  const gone = new ApiError(404, { code: "gone", what: "It is gone." });
  const told = [];
  const look = looks(false, gone, true);
  await poll(look, 1, new AbortController().signal, (error) => told.push(error));
  assert.deepEqual(told, [gone]);
  assert.equal(look.times, 2);
});

test("it ends when the view is left, even while it waits", async () => {
  const left = new AbortController();
  const look = looks(false);
  const ended = poll(look, 3600_000, left.signal, assert.fail);
  setTimeout(() => left.abort(), 5);
  await ended;
  assert.equal(look.times, 1);
});

test("a rest ends early with the reason why", async () => {
  await assert.rejects(rest(3600_000, AbortSignal.abort("left")), (reason) => reason === "left");
  const stop = new AbortController();
  setTimeout(() => stop.abort(), 5);
  await assert.rejects(rest(3600_000, stop.signal), { name: "AbortError" });
  await rest(1);
});
