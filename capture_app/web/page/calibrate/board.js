// Which printed board, as it came out of the printer, and where it is on the object.
import { box, h, inRow, stacked } from "../core/dom.js";
import { choice, field, number } from "../parts/fields.js";
import { PointPicker } from "../parts/pick_points.js";
/** @import {Boards} from "../core/answers.js" */

/** Lengths in mm. @typedef {{columns: number, rows: number, square: number, marker: number,
 *    dictionary: string}} Board */
/** @typedef {{width: number, height: number}} Size */

const OTHER = "other";
const RULER = 150; // mm, the long ruler of the sheet
/** @type {Record<string, number>} */
const UNITS = { mm: 1, cm: 10, m: 1000, in: 25.4 };
const TEXT = /^(\d+)x(\d+):([\d.]+)(mm|cm|m|in):([\d.]+)(mm|cm|m|in):(\w+)$/i;
const PLAIN = /^checkerboard:(\d+)x(\d+):([\d.]+)(mm|cm|m|in)$/i;

/** "5x7:35mm:26mm:DICT" -> its numbers in mm, or null.
 *  @param {string} text @returns {Board | null} */
export function parseBoard(text) {
  const found = TEXT.exec(text.trim());
  if (!found) return null;
  const [, columns, rows, square, squareUnit, marker, markerUnit, dictionary] = found;
  return {
    columns: Number(columns),
    rows: Number(rows),
    square: Number(square) * UNITS[squareUnit.toLowerCase()],
    marker: Number(marker) * UNITS[markerUnit.toLowerCase()],
    dictionary,
  };
}

/** "checkerboard:9x6:25mm" -> its squares, in mm; or null.
 *  @param {string} text @returns {{columns: number, rows: number, square: number} | null} */
export function parseCheckerboard(text) {
  const found = PLAIN.exec(text.trim());
  if (!found) return null;
  const [, columns, rows, square, unit] = found;
  const side = Number(square) * UNITS[unit.toLowerCase()];
  return { columns: Number(columns) + 1, rows: Number(rows) + 1, square: side };
}

/** The text of a board whose squares are longer by this factor. @param {Board} board */
export function boardText(board, factor = 1) {
  const [square, marker] = [board.square, board.marker].map((side) => `${Number((side * factor).toFixed(4))}mm`);
  return `${board.columns}x${board.rows}:${square}:${marker}:${board.dictionary}`;
}

/** Which board. `boards`: as the server lists them; `changed()` when it is another.
 *  {node, read() -> text or "", size() -> {width, height} in mm or null}
 *  @param {Boards} boards @param {{changed?: () => void, print?: boolean, none?: string, markers?: boolean}} more */
export function boardField(boards, { changed = () => {}, print = true, none = "", markers = false } = {}) {
  const papers = Object.keys(boards).map((name) => [name, `${name} sheet`]);
  const paper = choice("The board", [
    ...(none ? [["", none]] : []),
    ...papers,
    [OTHER, markers ? "Another board, or markers" : "Another board"],
  ]);
  const text = h("input", { maxlength: 200, placeholder: "5x7:35mm:26mm:DICT_5X5_100" });
  const typed = field(
    "As it is written on the board",
    text,
    "Columns x rows : square : marker : dictionary; or checkerboard:9x6:25mm for a plain one (its inner corners)" +
      `${markers ? "; or tag36h11:80mm, DICT_4X4_50:50mm for markers (side of the black square)" : ""}.`,
  );
  const ruler = number("The ruler that says 150 mm measures", {
    unit: "mm",
    min: 120,
    max: 180,
    hint: "Printers shrink a little: that does no harm if it is said. Empty: 150.",
  });
  const sheet = h("a", { class: "button", download: "board.pdf" }, "Get the sheet to print (PDF)");
  const show = () => {
    typed.hidden = paper.read() !== OTHER;
    const own = paper.read() in boards;
    sheet.hidden = !own || !print;
    ruler.node.hidden = !own || !print;
    sheet.href = `/api/calibration/board.pdf?paper=${encodeURIComponent(paper.read())}`;
  };
  const board = () => parseBoard(paper.read() === OTHER ? text.value : textOf());
  const textOf = () => boards[paper.read()]?.text ?? "";
  const factor = () => (ruler.node.hidden ? 1 : (ruler.read() ?? RULER) / RULER);
  for (const input of [paper.input, text, ruler.input]) input.addEventListener("change", () => (show(), changed()));
  show();
  return {
    node: stacked(paper.node, typed, inRow(sheet), ruler.node),
    read: () => {
      const known = board();
      // What cannot be read here is refused by the server, in words.
      return known ? boardText(known, factor()) : paper.read() === OTHER ? text.value.trim() : "";
    },
    size: () => {
      const known = board() ?? (paper.read() === OTHER ? parseCheckerboard(text.value) : null);
      return (
        known && {
          width: known.columns * known.square * factor(),
          height: known.rows * known.square * factor(),
        }
      );
    },
  };
}

/** @type {Record<string, [number, number]>} */
const CORNERS = {
  "top left, where the arrows start": [0, 0],
  "top right": [1, 0],
  "bottom right": [1, 1],
  "bottom left": [0, 1],
};

/** Where the board is on the object, by its corners. {node, picker, show(id), read(size)}
 *  @param {AbortSignal} signal */
export function boardPlace(signal) {
  const picker = new PointPicker({
    names: Object.keys(CORNERS),
    enough: 3,
    label: "This corner of the chequered area",
    words: ({ chosen, left }) =>
      left > 0
        ? `Click where the board's corner “${chosen}” is on the object. ${left} more at least.`
        : left === 0
          ? "Enough to try. The fourth corner shows mistakes."
          : "Good.",
    signal,
  });
  /** @param {Size} size */
  const read = ({ width, height }) => ({
    points: picker.points.map(({ name, at }) => ({
      board_mm: [CORNERS[name][0] * width, CORNERS[name][1] * height],
      object: at,
    })),
  });
  /** @param {string | null} id */
  const show = (id) => picker.show(id);
  const node = box("split even", stacked(picker.stage.node, picker.status), picker.content);
  return { node, picker, show, read };
}

/** What to do, one thing each. @param {string[] | undefined} lines */
export function todo(lines) {
  if (!lines?.length) return null;
  if (lines.length === 1) return h("p", { class: "todo" }, lines[0]);
  return h("ol", { class: "todo" }, lines.map((line) => h("li", {}, line)));
}
