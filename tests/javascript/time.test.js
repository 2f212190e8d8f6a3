// Playing, the ticks and the clock of the timeline, the film's pictures.
import assert from "node:assert/strict";
import test from "node:test";

import { clock } from "../../capture_app/replay/viewer/elements.js";
import { nearest } from "../../capture_app/replay/viewer/film.js";
import { playedOn } from "../../capture_app/replay/viewer/playback.js";
import { tickSeconds } from "../../capture_app/replay/viewer/ticks.js";
import { near } from "./near.js";

test("playing goes on within the take", () => {
  assert.deepEqual(playedOn(1, 0.5, [0, 4], true), { time: 1.5, stops: false });
  assert.deepEqual(playedOn(3.5, 0.5, [0, 4], false), { time: 4, stops: false });
});

test("behind the end it begins again, by as much as it went too far", () => {
  const { time, stops } = playedOn(3.5, 0.75, [0, 4], true);
  near([time], [0.25]);
  assert.equal(stops, false);
});

test("a stretch is played over and over, also from behind it", () => {
  near([playedOn(1.9, 0.2, [1, 2], true).time, playedOn(3.5, 0.2, [1, 2], true).time], [1.1, 1.7]);
  near([playedOn(0.2, 0.1, [1, 2], true).time], [0.3]);
});

test("without a loop it stops at the end", () => {
  assert.deepEqual(playedOn(3.5, 7, [0, 4], false), { time: 4, stops: true });
});

test("a clock has hundredths, and minutes from the first on", () => {
  assert.equal(clock(0), "0.00 s");
  assert.equal(clock(7.456), "7.46 s");
  assert.equal(clock(60), "1:00.00");
  assert.equal(clock(65.5), "1:05.50");
  assert.equal(clock(3725.25), "62:05.25");
});

test("seconds that round up to a minute are a minute", () => {
  assert.equal(clock(59.996), "1:00.00");
  assert.equal(clock(119.999), "2:00.00");
  assert.equal(clock(59.994), "59.99 s");
});

test("ticks begin at 0, are evenly apart, and at most a dozen follow", () => {
  for (const duration of [0.3, 1, 4.9, 12, 59, 600, 7200, 14000]) {
    const ticks = tickSeconds(duration);
    assert.equal(ticks[0], 0);
    assert.ok(ticks.length >= 2 && ticks.length <= 13, `${ticks.length} ticks in ${duration} s`);
    ticks.forEach((tick, k) => near([tick], [k * ticks[1]]));
    assert.ok(duration - ticks.at(-1) < ticks[1], `no tick near the end of ${duration} s`);
  }
});

test("a tick stands at an end that is a whole number of steps away", () => {
  for (const duration of [0.3, 0.6, 0.7, 1.2, 2.4])
    near([tickSeconds(duration).at(-1)], [duration]);
});

test("a single frame has one tick", () => {
  assert.deepEqual(tickSeconds(0), [0]);
});

test("the picture that is shown is the nearest in time", () => {
  const times = [0, 1, 2, 5];
  assert.deepEqual(
    [-3, 0, 0.4, 0.6, 1.9, 3.4, 3.6, 99].map((time) => nearest(times, time)),
    [0, 0, 0, 1, 2, 2, 3, 3],
  );
  assert.equal(nearest([7], 0), 0);
});
