// What several ways share: the recording, the board and where it is, a look at what was brought.
import { api } from "../core/api.js";
import { brought } from "../parts/brought.js";
import { boardField, boardPlace, todo } from "./board.js";
/** @import {Look} from "../parts/brought.js"
 *  @import {Context} from "./recorded.js" */

/** @typedef {Record<string, string[]>} Steps */
/** What else a look needs to know. @typedef {() => Record<string, string>} More */

/** The steps of a way as the server tells them.
 *  @param {Context} context @param {string} key @returns {Steps} */
export function stepsOf({ guide }, key) {
  return guide.ways[key].steps;
}

/** A look at something that was brought. @param {string} of @param {More} more @returns {Look} */
export function looker(of, more = () => ({})) {
  return (id, signal) => api(`/api/calibration/look?${new URLSearchParams({ of, id, ...more() })}`, { signal });
}

/** @param {Context} context @param {{look?: string, more?: More, text?: string}} asked */
export function recording(context, { look, more, text = "The folder your logger app wrote, or a zip of it." }) {
  return brought({
    label: "The recording",
    kind: "session",
    items: context.sessions,
    title: "Drop the recording here",
    text,
    folder: true,
    signal: context.signal,
    look: look ? looker(look, more) : null,
  });
}

/** The board and its place, as two parts. `again`: have things to be looked at again for another board.
 *  @param {Context} context @param {Steps} steps @param {() => void} again */
export function boardParts(context, steps, again) {
  const board = boardField(context.guide.boards, { changed: () => again() });
  const place = boardPlace(context.signal);
  return {
    parts: [
      { title: "The board", content: [todo(steps["The board"]), board.node] },
      {
        title: "Where the board is on the object",
        content: [todo(steps["Where the board is on the object"]?.slice(0, 1)), place.node],
      },
    ],
    show: place.show,
    text: board.read,
    read: () => ({ board: board.read(), place: place.read(board.size() ?? { width: 0, height: 0 }) }),
  };
}
