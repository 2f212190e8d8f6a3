import assert from "node:assert/strict";
import test from "node:test";

import * as words from "../../capture_app/web/page/core/words.js";

test("sizes are told in steps of a thousand", () => {
  const told = { 0: "0 bytes", 999: "999 bytes", 1000: "1.0 kB", 1536: "1.5 kB", 150000: "150 kB" };
  for (const [bytes, text] of Object.entries(told)) assert.equal(words.size(Number(bytes)), text);
  assert.equal(words.size(2_400_000), "2.4 MB");
  assert.equal(words.size(3e9), "3.0 GB");
  assert.equal(words.size(5e15), "5000 TB");
});

test("a size that rounds up to a thousand is one of the next unit", () => {
  assert.equal(words.size(999_499), "999 kB");
  assert.equal(words.size(999_700), "1.0 MB");
  assert.equal(words.size(999_999_999), "1.0 GB");
  assert.equal(words.size(99_960), "100 kB");
});

test("times are told in the two units that matter", () => {
  const told = [
    [0.04, "0.0 s"],
    [9.94, "9.9 s"],
    [10, "10 s"],
    [59.4, "59 s"],
    [59.6, "1 min 0 s"],
  ];
  for (const [seconds, text] of told) assert.equal(words.span(seconds), text);
  assert.equal(words.span(83), "1 min 23 s");
  assert.equal(words.span(3599.7), "1 h 0 min");
  assert.equal(words.span(7322), "2 h 2 min");
  assert.equal(words.span(7199), "1 h 59 min");
});

test("a time that rounds up to ten seconds has no decimals", () => {
  assert.equal(words.span(9.97), "10 s");
});

test("one is singular, all else plural", () => {
  assert.equal(words.count(1, "file"), "1 file");
  assert.equal(words.count(0, "file"), "0 files");
  assert.equal(words.count(2, "try", "tries"), "2 tries");
  assert.equal(words.count(12345, "file"), "12,345 files");
});

test("the past is told by its largest unit", (t) => {
  t.mock.timers.enable({ apis: ["Date"], now: Date.parse("2026-06-15T12:00:00Z") });
  const told = [
    ["2026-06-15T11:59:30Z", "just now"],
    ["2026-06-15T11:58:00Z", "2 minutes ago"],
    ["2026-06-15T09:00:00Z", "3 hours ago"],
    ["2026-06-14T11:00:00Z", "yesterday"],
    ["2026-06-05T12:00:00Z", "10 days ago"],
    ["2026-05-01T12:00:00Z", "01/05/2026"],
  ];
  for (const [date, text] of told) assert.equal(words.ago(date), text);
});

test("sides are in centimetres, those of small things in millimetres", () => {
  assert.equal(words.sides([0.52, 0.476, 0.554]), "52 × 48 × 55 cm");
  assert.equal(words.sides([0.012, 0.0405, 0.099]), "12 × 41 × 99 mm");
  assert.equal(words.sides([0.02, 0.03, 1.2]), "2 × 3 × 120 cm");
});

test("a stretch tells the times that are known", () => {
  assert.equal(words.stretch([1.24, 3]), "1.2 to 3.0 s");
  assert.equal(words.stretch([null, 3]), "3.0 s");
  assert.equal(words.stretch([null, null]), "");
});

test("sentences begin with a capital", () => {
  assert.equal(words.capital("tracking was lost"), "Tracking was lost");
  assert.equal(words.capital(""), "");
});

test("a job's stages are known before it runs; the video is a job of its own", () => {
  assert.deepEqual(words.stagesOf("resolve"), ["read", "solve", "export"]);
  assert.equal(words.stagesOf("run").at(-1), "export");
  assert.deepEqual(words.stagesOf("export"), []);
  for (const kind of ["run", "resolve", "scan"])
    for (const stage of words.stagesOf(kind)) assert.ok(words.STAGES[stage], stage);
});

test("a job has ended where no worker will touch it by itself", () => {
  const over = Object.keys(words.STATES).filter((state) => words.ended({ state }));
  assert.deepEqual(over.sort(), ["cancelled", "done", "failed"]);
});
