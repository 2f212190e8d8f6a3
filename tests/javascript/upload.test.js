import assert from "node:assert/strict";
import test from "node:test";

import { Upload, earlier } from "../../capture_app/web/page/upload/send.js";
import { served } from "./served.js";

const ORDER = {
  kind: "session",
  name: "take",
  files: [
    { path: "odometry.csv", file: new File(["0123456789"], "odometry.csv") },
    { path: "empty.txt", file: new File([], "empty.txt") },
  ],
};

/** A server that keeps what arrives; `more(method, path)` may answer in its place. */
function library(t, more = () => null) {
  const kept = ["", ""];
  const listed = () =>
    ORDER.files.map(({ path, file }, index) => {
      return { index, path, size: file.size, received: kept[index].length };
    });
  const calls = served(t, async (path, { method, body }) => {
    const told = await more(method, path);
    if (told) return told;
    if (path.endsWith("/finish")) return { body: { kind: "session", id: "u1" } };
    if (method === "DELETE") return { status: 204 };
    if (method !== "PUT") return { body: { id: "u1", files: listed() } };
    const index = Number(/files\/(\d+)/.exec(path)[1]);
    kept[index] += await body.text();
    return { body: { received: kept[index].length } };
  });
  return { kept, calls };
}

test("all that was dropped arrives, and becomes a thing of the library", async (t) => {
  const { kept } = library(t);
  const upload = new Upload(ORDER);
  await upload.start();
  assert.deepEqual(kept, ["0123456789", ""]);
  assert.deepEqual(
    [upload.state, upload.received, upload.item],
    ["done", 10, { kind: "session", id: "u1" }],
  );
});

test("a file is sent in pieces, each behind the last", async (t) => {
  const { kept, calls } = library(t);
  const upload = new Upload(ORDER);
  upload.chunk = 4;
  upload.fit = () => {};
  await upload.start();
  assert.equal(kept[0], "0123456789");
  const sent = calls
    .filter(({ method }) => method === "PUT")
    .map(({ path }) => path.split("offset=")[1]);
  assert.deepEqual(sent, ["0", "4", "8"]);
});

test("it goes on where the server is, when another tab was faster", async (t) => {
  const { kept } = library(t, (method, path) => {
    if (method !== "PUT" || !path.endsWith("offset=0")) return null;
    kept[0] = "012345";
    return { status: 409, body: { error: { code: "offset", what: "Not there.", received: 6 } } };
  });
  await new Upload(ORDER).start();
  assert.equal(kept[0], "0123456789");
});

test("what the server refuses ends it, in words, and it can be tried again", async (t) => {
  let full = true;
  const more = (method) =>
    full && method === "PUT"
      ? { status: 413, body: { error: { code: "too-large", what: "It is too large." } } }
      : null;
  library(t, more);
  const upload = new Upload(ORDER);
  await upload.start();
  assert.deepEqual([upload.state, upload.error.what], ["failed", "It is too large."]);
  full = false;
  await upload.start();
  assert.equal(upload.state, "done");
});

test("it stays paused when the last piece arrives, and cancelling takes it off", async (t) => {
  const upload = new Upload(ORDER);
  const { calls } = library(t, (method) => {
    if (method === "PUT") upload.pause();
    return null;
  });
  await upload.start();
  assert.equal(upload.state, "paused");
  await upload.cancel();
  assert.deepEqual([calls.at(-1).method, calls.at(-1).path], ["DELETE", "/api/uploads/u1"]);
  assert.equal(upload.state, "cancelled");
});

test("cancelling before the server has answered takes it off all the same", async (t) => {
  let answer;
  const asked = new Promise((resolve) => (answer = resolve));
  const { calls } = library(t, (method) => (method === "POST" ? asked : null));
  const upload = new Upload(ORDER);
  const started = upload.start();
  upload.pause();
  const cancelled = upload.cancel();
  answer(null);
  await Promise.all([started, cancelled]);
  assert.deepEqual(
    calls.map(({ method }) => method),
    ["POST", "DELETE"],
  );
  assert.equal(upload.state, "cancelled");
});

test("who goes on before the server has answered begins no second upload", async (t) => {
  let answer;
  const asked = new Promise((resolve) => (answer = resolve));
  const { kept, calls } = library(t, (_, path) => (path === "/api/uploads" ? asked : null));
  const upload = new Upload(ORDER);
  const first = upload.start();
  upload.pause();
  const second = upload.start();
  answer(null);
  await Promise.all([first, second]);
  assert.equal(calls.filter(({ path }) => path === "/api/uploads").length, 1);
  assert.deepEqual([upload.state, kept[0]], ["done", "0123456789"]);
});

test("pieces take about a second, within bounds", () => {
  const upload = new Upload(ORDER);
  upload.fit(2_000_000, 500);
  assert.equal(upload.chunk, 4_000_000);
  upload.fit(1000, 60_000);
  assert.equal(upload.chunk, 256 * 1024);
  upload.fit(16e6, 0);
  assert.equal(upload.chunk, 16 * 1024 * 1024);
});

test("how long still is told once there is a rate", () => {
  const upload = new Upload(ORDER);
  assert.equal(upload.secondsLeft, null);
  Object.assign(upload, { rate: 2, received: 4 });
  assert.equal(upload.secondsLeft, 3);
});

test("an unfinished upload is continued only by the same files", async (t) => {
  const head = { id: "u7", kind: "session", name: "take" };
  const files = [
    { path: "odometry.csv", size: 10 },
    { path: "empty.txt", size: 0 },
  ];
  served(t, (path) => ({
    body:
      path === "/api/uploads" ? [{ ...head, id: "x", kind: "object" }, head] : { ...head, files },
  }));
  assert.equal((await earlier(ORDER)).id, "u7");
  files[0].size = 11;
  assert.equal(await earlier(ORDER), null);
  files[0].size = 10;
  files.push({ path: "more.txt", size: 1 });
  assert.equal(await earlier(ORDER), null);
});
