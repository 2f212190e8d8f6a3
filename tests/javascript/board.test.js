import assert from "node:assert/strict";
import test from "node:test";

import { boardText, parseBoard, parseCheckerboard } from "../../capture_app/web/page/calibrate/board.js";

const BOARD = { columns: 5, rows: 7, square: 35, marker: 26, dictionary: "DICT_5X5_100" };

test("a board's text is read in any unit, as millimetres", () => {
  assert.deepEqual(parseBoard("5x7:35mm:26mm:DICT_5X5_100"), BOARD);
  assert.deepEqual(parseBoard(" 5X7:3.5cm:2.6CM:DICT_5X5_100 "), BOARD);
  const metres = parseBoard("5x7:0.035m:1in:DICT_5X5_100");
  assert.ok(Math.abs(metres.square - 35) < 1e-9);
  assert.equal(metres.marker, 25.4);
});

test("what is no board is none", () => {
  for (const text of [
    "",
    "5x7",
    "5x7:35:26:DICT",
    "5x7:35mm:26mm:",
    "x7:35mm:26mm:DICT",
    "5x7:35mm:26mm:DICT now",
  ])
    assert.equal(parseBoard(text), null, text);
});

test("a board that is written is read again", () => {
  assert.equal(boardText(BOARD), "5x7:35mm:26mm:DICT_5X5_100");
  assert.deepEqual(parseBoard(boardText(BOARD)), BOARD);
});

test("a printer that shrinks makes smaller squares and markers", () => {
  assert.equal(boardText(BOARD, 148.5 / 150), "5x7:34.65mm:25.74mm:DICT_5X5_100");
});

test("a plain checkerboard has one square more than inner corners", () => {
  const board = parseCheckerboard("Checkerboard:9x6:2.5cm");
  assert.deepEqual(board, { columns: 10, rows: 7, square: 25 });
  assert.equal(parseCheckerboard("tag36h11:80mm"), null);
});
