// Videos of a motion: seen from elsewhere, or in a film of the take.
import { freshKey, missing } from "../core/api.js";
import { folded, h, inRow, say, stacked } from "../core/dom.js";
import { toJob } from "../core/router.js";
import { boardField, boardPlace } from "../calibrate/board.js";
import { cameraFields } from "../calibrate/camera.js";
import { brought } from "./brought.js";
import { choice, describedFields, grid, saidIn, sends } from "./fields.js";
/** @import {Choices, Guide, Item, Result, Session} from "../core/answers.js"
 *  @import {Stage} from "./stage.js" */

/** `sample()`: which one is drawn, from 1.
 *  @typedef {{choices: Choices, guide: Guide, videos: Item[], sessions: Session[], sample: () => number,
 *    stage: Stage, signal: AbortSignal}} Context */

const FEW = 0.1; // part of the time in which a film has to show the person

/** A video from a camera of its own. @param {Result} item @param {Context} context */
export function renderForm(item, { choices, sample }) {
  const fields = describedFields(choices.forms.render);
  const read = () => ({ kind: "render", result: item.id, sample: sample(), ...saidIn(fields) });
  return orderForm("Draw the video", read, [grid(fields)]);
}

/** The person in a film of the take: the phone's own, or that of a camera that watched.
 *  @param {Result} item @param {Context} context */
export function overlayForm(item, context) {
  const other = otherFilm(item, context);
  const film = choice("Into", [
    ...(item.session ? [["own", "what the phone filmed"]] : []),
    ["other", "the film of another camera"],
  ]);
  const unseen = h("p", { class: "hint", role: "status" });
  const show = () => {
    other.node.hidden = film.read() !== "other";
    unseen.hidden = !other.node.hidden;
  };
  let chosen = false;
  film.input.addEventListener("change", () => {
    chosen = true;
    show();
  });
  const seen = () => {
    const share = context.stage.viewer?.header(0)?.filmed[context.sample() - 1] ?? 1;
    say(unseen, share < FEW ? nobody(share) : "");
    // What shows the person is chosen, until somebody chooses.
    if (!chosen) film.input.value = share < FEW || !item.session ? "other" : "own";
    show();
  };
  context.stage.addEventListener("opened", seen);
  seen();
  const fields = describedFields(context.choices.forms.overlay);
  const read = () => ({
    kind: "overlay",
    result: item.id,
    sample: context.sample(),
    ...saidIn(fields),
    ...(film.read() === "other" ? other.read() : {}),
  });
  return orderForm("Draw into the film", read, [
    film.node,
    unseen,
    other.node,
    folded("How it looks, and when", grid(fields)),
  ]);
}

/** @param {number} share of the time */
function nobody(share) {
  const seen = share > 0 ? `in ${Math.max(1, Math.round(100 * share))} % of the time only` : "at no time";
  return (
    `The phone on the object looks away from the person and films them ${seen}. ` +
    "The film of another camera shows them."
  );
}

/** @param {Result} item @param {Context} context */
function otherFilm(item, { guide, videos, sessions, signal }) {
  const film = brought({
    label: "The film",
    kind: "video",
    items: [...videos, ...sessions.filter(({ id }) => id !== item.session)],
    title: "Drop the film here",
    text: "A video (MP4, MOV) of a camera that stood still; or choose a second phone's recording above.",
    accept: ".mp4,.mov,.m4v",
    signal,
  });
  const place = choice("Where the camera stood is told by", [
    ["object", "a board on the object"],
    ["room", "a board that lies in the room"],
    ["given", "its numbers, which I have"],
    ["shared", "one ARKit world of both phones"],
  ]);
  const board = boardField(guide.boards, { print: false });
  const where = boardPlace(signal);
  const camera = cameraFields({ pose: true });
  const known = folded("I know where the board is on the object", where.node);
  const numbers = folded("The camera's numbers", camera.node);
  known.addEventListener("toggle", () => known.open && where.show(item.object ?? null));
  const show = () => {
    const by = place.read();
    board.node.hidden = !["object", "room"].includes(by);
    known.hidden = by !== "object" || !item.object;
    numbers.hidden = by === "shared";
    numbers.open = by === "given";
  };
  place.input.addEventListener("change", show);
  show();
  const read = () => {
    if (!film.read()) {
      throw missing("The film is still missing.");
    }
    const by = place.read();
    const boarded = ["object", "room"].includes(by);
    const size = board.size();
    const placed = by === "object" && where.picker.points.length > 0;
    return {
      video: film.read(),
      board: boarded ? board.read() : null,
      board_at: by === "room" ? "room" : "object",
      place: placed && size ? where.read(size) : null,
      camera: numbers.hidden ? null : camera.read(),
      shared_world: by === "shared",
    };
  };
  return { node: stacked(film.node, place.node, board.node, known, numbers), read };
}

/** A form that orders a job and goes to it.
 *  @param {string} words @param {() => object} read @param {HTMLElement[]} fields */
function orderForm(words, read, fields) {
  const problem = h("div");
  const button = h("button", { type: "submit" }, words);
  const key = freshKey();
  const submit = () => toJob(read(), key);
  return h("form", { class: "stack", ...sends(button, problem, submit) }, fields, inRow(button), problem);
}
