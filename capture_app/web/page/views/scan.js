// An object made from a film of it: how to film, what with, what gives its size.
import { api, freshKey, missing } from "../core/api.js";
import { box, folded, h, inRow, numbered, put, stacked } from "../core/dom.js";
import { toJob } from "../core/router.js";
import { boardField, todo } from "../calibrate/board.js";
import { brought } from "../parts/brought.js";
import { choice, describedFields, grid, number, saidIn, sends } from "../parts/fields.js";
import { PointPicker } from "../parts/pick_points.js";
/** @import {Boards, Choices, Guide, Item, Session} from "../core/answers.js"
 *  @import {Visit} from "../core/router.js" */

const HOW = [
  "Leave the object where it stands, alone. Nobody moves it, or anything near it, while you film.",
  "Give it light. A plain object (white, black, shiny) needs something to see on it: tape, paper with print.",
  "Walk around it twice, a hand's width more than its size away: once level with its middle, once " +
    "from above, looking down on it. Keep some floor in the picture. Half a minute a round.",
  "For what is open (a bin, a shelf) film a third round into it.",
];
const WITH = {
  session: "A recording of the phone: knows its size by itself",
  video: "A video",
  material: "Photos, or a mesh of another app",
  room: "The mesh of a room that an app made: the object is cut out of it",
};

const TAKES = "This takes some minutes. It goes on when you leave the page, and can be cancelled.";

/** @typedef {"session" | "video" | "material" | "room"} Kind */
/** @type {Record<string, string>} */
const SIZES = {
  session: "The phone's poses say how large it is. Nothing is needed here.",
  room: "The app measured the room in metres. A height is needed only if you know better.",
  video: "Pictures alone do not say how large it is: measure its height, or lay a printed board or marker beside it.",
};

/** @typedef {{sessions: Session[], videos: Item[], materials: Item[], guide: Guide, choices: Choices,
 *    signal: AbortSignal}} Context */
/** @typedef {ReturnType<typeof sourcesOf>} Sources */

/** `#/scan?source=ID&back=...` @param {Visit} visit */
export async function scan({ query, signal }) {
  const [sessions, videos, materials, guide, choices] = await Promise.all(
    ["sessions", "videos", "materials", "calibration", "choices"].map((what) => api(`/api/${what}`, { signal })),
  );
  const page = new ScanPage({ sessions, videos, materials, guide, choices, signal }, query);
  return { title: "An object from a film", node: page.node };
}

class ScanPage {
  /** @param {Context} context @param {URLSearchParams} query */
  constructor(context, query) {
    this.context = context;
    this.back = query.get("back");
    this.key = freshKey();
    this.sources = sourcesOf(context, query.get("source"), () => this.changed());
    this.stood = standsAt(context.signal);
    this.kind = choice("Filmed with", Object.entries(WITH), { value: kindOf(this.sources) });
    this.kind.input.addEventListener("change", () => this.show());
    this.place = box("stack");
    this.fields = sizeFields(context.guide.boards);
    this.more = describedFields(context.choices.forms.scan);
    this.name = h("input", { maxlength: 120, required: true, value: "" });
    this.problem = h("div");
    this.button = h("button", { type: "submit", class: "main large" }, "Make the object");
    this.options = folded("More options", grid(this.more));
    this.takes = h("p", { class: "hint" });
    this.node = this.draw();
    this.show();
    this.named();
  }

  get cuts() {
    return this.kind.read() === "room";
  }

  get source() {
    return this.sources[/** @type {Kind} */ (this.kind.read())];
  }

  show() {
    put(this.place, this.source.node, this.cuts && this.stood.node);
    const kind = this.kind.read();
    this.fields.hint(kind);
    this.more.format.node.hidden = kind !== "session";
    this.options.hidden = this.cuts;
    put(this.takes, this.cuts ? "This takes some seconds." : TAKES);
    this.changed();
  }

  changed() {
    this.named();
    const id = this.cuts ? this.source.read() : null;
    if (id !== this.stood.picker.object) this.stood.picker.show(id);
  }

  /** Called as its film is, unless somebody has said otherwise. */
  named() {
    if (this.name.dataset.mine) return;
    const { input } = this.source.stored;
    const words = input.selectedOptions[0]?.textContent ?? "";
    this.name.value = input.value ? words.replace(/, [^,]*$/, "") : "";
  }

  draw() {
    this.name.addEventListener("input", () => (this.name.dataset.mine = "yes"));
    return h(
      "form",
      { class: "stack wide", ...sends(this.button, this.problem, () => this.send()) },
      h(
        "header",
        {},
        h("h1", {}, "Make the object from a film of it"),
        h("p", { class: "lead" }, "In metres, in its colours, cut out of the room. No other program is needed."),
      ),
      numbered(1, "Film it", todo(HOW)),
      numbered(2, "The film", stacked(this.kind.node, this.place)),
      numbered(3, "Its size", this.fields.node),
      numbered(
        4,
        "The object",
        stacked(
          h("label", { class: "field" }, h("span", {}, "Name of the object"), this.name),
          this.options,
          inRow(this.button),
          this.takes,
          this.problem,
        ),
      ),
    );
  }

  async send() {
    const source = this.source.read();
    if (!source) {
      throw missing("The film is still missing.");
    }
    /** @type {Record<string, unknown>} */
    const json = {
      kind: "scan",
      name: this.name.value.trim(),
      source,
      ...this.fields.read(),
      ...(this.cuts ? this.stood.read() : saidIn(this.more)),
    };
    if (this.more.format.node.hidden) json.format = null;
    await toJob(json, this.key, { from: location.hash, back: this.back });
  }
}

/** @param {Context} context @param {string | null} current @param {() => void} changed */
function sourcesOf({ sessions, videos, materials, signal }, current, changed) {
  /** @param {"session" | "video" | "material"} kind @param {Item[]} items @param {string} title
   *  @param {string} text @param {{folder?: boolean, accept?: string, label?: string}} more */
  const one = (kind, items, title, text, more) =>
    brought({ label: "The film", kind, items, current, title, text, signal, changed, ...more });
  return {
    session: one(
      "session",
      sessions,
      "Drop the recording here",
      "The folder your logger app wrote while you filmed the object, or a zip of it.",
      { folder: true },
    ),
    video: one("video", videos, "Drop the video here", "MP4 or MOV.", { accept: ".mp4,.mov,.m4v" }),
    material: one(
      "material",
      materials,
      "Drop the photos here",
      "A folder or a zip of photos; a COLMAP model; or a mesh (GLB, OBJ, PLY, STL, USDZ).",
      { folder: true },
    ),
    room: one(
      "material",
      [...materials, ...sessions],
      "Drop the room's mesh here",
      "GLB or USDZ, or a folder or a zip of an OBJ with its pictures. A recording that holds one " +
        "can be chosen above.",
      { folder: true, label: "The room" },
    ),
  };
}

/** @param {Sources} sources */
function kindOf(sources) {
  return Object.entries(sources).find(([, one]) => one.read())?.[0] ?? "session";
}

/** @param {Boards} boards */
function sizeFields(boards) {
  const words = h("p", { class: "hint" });
  const height = number("Height of the object", { unit: "m", min: 0.01, max: 10 });
  const board = boardField(boards, { print: true, none: "no board beside it", markers: true });
  const node = stacked(words, box("grid", height.node, board.node));
  return {
    node,
    hint: (/** @type {string} */ kind) => {
      board.node.hidden = kind === "room";
      put(words, SIZES[kind] ?? SIZES.video);
    },
    read: () => ({ height: height.read(), board: board.node.hidden ? null : board.read() || null }),
  };
}

/** Where in a room the object stands, by a click. {node, picker, read()} @param {AbortSignal} signal */
function standsAt(signal) {
  const picker = new PointPicker({
    names: ["The place"],
    enough: 1,
    label: "The place",
    what: "room",
    scene: (id) => `/api/rooms/${id}/scene`,
    words: ({ left }) => (left > 0 ? "Click on the object." : "Good."),
    signal,
  });
  const node = stacked(picker.stage.node, picker.status, picker.content);
  const read = () => ({ method: "mesh", at: picker.points[0]?.at ?? null });
  return { node, picker, read };
}
