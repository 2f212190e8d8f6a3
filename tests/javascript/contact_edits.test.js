import assert from "node:assert/strict";
import test from "node:test";

import { ContactEdits } from "../../capture_app/replay/viewer/contact_edits.js";

const LEFT = { hand: "left", start: 10, stop: 20, anchor: [0.1, 0.2, 0.3] };
const LATER = { hand: "left", start: 40, stop: 50, anchor: [0.4, 0.5, 0.6] };
const RIGHT = { hand: "right", start: 12, stop: 60, anchor: [0, 0, 1] };
const made = () => new ContactEdits([LATER, RIGHT, LEFT], 100, 30);
const spans = (edits) => edits.segments.map(({ hand, start, stop }) => [hand, start, stop]);

test("segments are in the order of time", () => {
  assert.deepEqual(spans(made()), [
    ["left", 10, 20],
    ["right", 12, 60],
    ["left", 40, 50],
  ]);
});

test("of two hands that begin at once the left one is first", () => {
  const edits = new ContactEdits([{ ...RIGHT, start: 10 }, LEFT], 100, 30);
  assert.deepEqual(
    edits.segments.map(({ hand }) => hand),
    ["left", "right"],
  );
});

test("what was given is not changed by edits", () => {
  const edits = made();
  edits.moved(edits.segments[0], "stop", 5);
  assert.equal(LEFT.stop, 20);
});

test("an end moves as far as its neighbour leaves room for the hand to travel", () => {
  const edits = made();
  assert.equal(edits.moved(edits.segments[0], "stop", 5).stop, 25);
  assert.equal(edits.moved(edits.segments[0], "stop", 500).stop, 37);
  assert.equal(edits.moved(edits.segments[0], "start", -500).start, 0);
});

test("an end does not pass the other: a frame is left", () => {
  const edits = made();
  const short = edits.moved(edits.segments[0], "start", 500);
  assert.deepEqual([short.start, short.stop], [19, 20]);
  const [other] = made().segments;
  assert.equal(made().moved(other, "stop", -500).stop, 11);
});

test("a whole segment keeps its length where it meets its bounds", () => {
  const edits = made();
  const pushed = edits.moved(edits.segments[0], "whole", 500);
  assert.deepEqual([pushed.start, pushed.stop], [27, 37]);
  const back = edits.moved(pushed, "whole", -500);
  assert.deepEqual([back.start, back.stop], [0, 10]);
});

test("the last segment may go on to the end of the take", () => {
  const edits = made();
  assert.equal(edits.moved(edits.segments[2], "stop", 500).stop, 100);
});

test("a move by nothing is no edit", () => {
  const edits = made();
  const [first] = edits.segments;
  assert.equal(edits.moved(first, "whole", 0), first);
  assert.equal(edits.past.length, 0);
  assert.equal(edits.dirty, false);
});

test("a new segment takes the room there is", () => {
  const edits = made();
  assert.equal(edits.add("left", 24).stop, 37);
  assert.equal(edits.add("left", 60).stop, 75);
  assert.equal(edits.add("left", 95).stop, 100);
});

test("there is no room in a segment, nor within the travel to it", () => {
  const edits = made();
  for (const frame of [7, 10, 15, 19, 22, 100]) assert.equal(edits.add("left", frame), null);
  assert.equal(edits.past.length, 0);
  assert.notEqual(edits.add("left", 23), null);
  assert.notEqual(edits.add("left", 6), null);
});

test("a hand is not in the way of the other", () => {
  assert.notEqual(made().add("right", 5), null);
  assert.equal(made().add("right", 15), null);
});

test("undo goes back one edit at a time and ends at the start", () => {
  const edits = made();
  const before = spans(edits);
  edits.moved(edits.segments[0], "stop", 3);
  edits.remove(edits.segments[1]);
  assert.equal(spans(edits).length, 2);
  edits.undo();
  assert.deepEqual(spans(edits)[0], ["left", 10, 23]);
  edits.undo();
  edits.undo();
  assert.deepEqual(spans(edits), before);
});

test("what was undone is made again, until something else is edited", () => {
  const edits = made();
  edits.moved(edits.segments[0], "stop", 3);
  const after = spans(edits);
  edits.undo();
  edits.redo();
  assert.deepEqual(spans(edits), after);
  edits.undo();
  edits.remove(edits.segments[1]);
  const other = spans(edits);
  edits.redo();
  assert.deepEqual(spans(edits), other);
});

test("reset gives back what was there, and can be undone", () => {
  const edits = made();
  edits.remove(edits.segments[0]);
  assert.equal(edits.dirty, true);
  edits.reset();
  assert.equal(edits.dirty, false);
  edits.undo();
  assert.equal(edits.dirty, true);
});

test("an edit that is taken back by hand leaves nothing to be solved", () => {
  const edits = made();
  edits.moved(edits.moved(edits.segments[0], "stop", 4), "stop", -4);
  assert.equal(edits.dirty, false);
});

test("a place on the object replaces the old one; without one the nearest is held", () => {
  const edits = made();
  const held = edits.hold(edits.segments[0], {
    anchor: [1, 1, 1],
    place: [1, 1, 0.98],
    normal: [0, 0, 1],
  });
  assert.deepEqual(held.anchor, [1, 1, 1]);
  const free = edits.hold(held, null);
  assert.deepEqual(Object.keys(free).sort(), ["hand", "start", "stop"]);
});

test("the file holds what contacts.json does, to a hundredth of a millimetre", () => {
  const edits = new ContactEdits(
    [{ ...LEFT, anchor: [0.123456789, -0.1, 0], place: [1, 2, 3] }],
    100,
    30,
  );
  assert.deepEqual(edits.file(), {
    version: 1,
    fps: 30,
    frames: 100,
    segments: [{ hand: "left", start: 10, stop: 20, anchor: [0.12346, -0.1, 0] }],
  });
});
