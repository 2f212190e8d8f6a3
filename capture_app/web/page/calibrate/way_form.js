// A calibration by recordings, as the server describes its way: what to do, what to bring, one button.
import { api, freshKey, missing } from "../core/api.js";
import { folded, h, hintLine, inRow, numbered, stacked } from "../core/dom.js";
import { toJob } from "../core/router.js";
import { broughtAs } from "../parts/brought.js";
import { choice, describedFields, saidIn, sends } from "../parts/fields.js";
import { objectField } from "../parts/mount_form.js";
import { boardField, boardPlace, todo } from "./board.js";
import { cameraFields, matrixField } from "./camera.js";
/** @import {Choices, Described, Guide, Item, Mount, Session, Thing, WayDescribed} from "../core/answers.js"
 *  @import {Field} from "../parts/fields.js" */

/** What the forms of the ways are made of, and for.
 *  @typedef {{choices: Choices, objects: Thing[], sessions: Session[], videos: Item[],
 *    materials: Item[], mounts: Mount[], guide: Guide, object: string | null, back: string | null,
 *    signal: AbortSignal}} Context */
/** A field that is brought is one to look at again for another board.
 *  @typedef {Field<any> & {lookAgain?: () => void, show?: (object: string | null) => void}} WayField */

/** The form of numbered parts. @param {WayDescribed} way @param {Context} context */
export function wayForm(way, context) {
  const { objects, object, back } = context;
  const fields = fieldsOf(way, context);
  const nodes = (/** @type {Described[]} */ all) => all.map(({ name }) => fields[name].node);
  const thing = objectField(objects, object, (id) => fields.place?.show?.(id));
  fields.place?.show?.(object);
  const name = h("input", { value: way.name, maxlength: 120, required: true });
  const problem = h("div");
  const button = h("button", { type: "submit", class: "main large" }, "Find the mount");
  const key = freshKey();
  const submit = async () => {
    const said = { object: thing.read(), ...saidIn(fields) };
    refuseMissing(way, said);
    const json = { kind: "calibrate", name: name.value.trim(), method: way.method, ...said };
    await toJob(json, key, { from: location.hash, back });
  };
  const parts = [
    ["The object", thing.node, meshHint()],
    ...way.parts.map((part) => [
      part.title,
      todo(part.todo),
      ...nodes(part.fields),
      part.more && folded(part.more, ...nodes(part.more_fields)),
    ]),
    ["The mount", h("label", { class: "field" }, h("span", {}, "Name of the mount"), name), inRow(button), problem],
  ];
  return h(
    "form",
    { class: "stack wide", ...sends(button, problem, submit) },
    parts.map(([title, ...content], at) => numbered(at + 1, String(title), stacked(content))),
  );
}

/** @param {WayDescribed} way @param {Context} context @returns {Record<string, WayField>} */
function fieldsOf(way, context) {
  const { guide, signal } = context;
  const described = way.parts.flatMap((part) => [...part.fields, ...part.more_fields]);
  const { sessions, videos, materials, objects, mounts } = context;
  /** @type {Record<string, Item[]>} */
  const kept = { session: sessions, video: videos, material: materials, object: objects, mount: mounts };
  const stored = (/** @type {Described} */ { shelves }) =>
    shelves.flatMap((/** @type {string} */ shelf) => kept[shelf]);
  const again = () => Object.values(made).forEach((one) => one.lookAgain?.());
  const board = boardField(guide.boards, { changed: () => again() });
  const place = boardPlace(signal);
  const read = () => place.read(board.size() ?? { width: 0, height: 0 });
  /** @type {Record<string, (one: Described) => any>} */
  const kinds = {
    board: () => board,
    place: () => ({ ...place, read }),
    camera: () => cameraFields(),
    matrix: ({ title, hint }) => matrixField(`${title}: four rows of four numbers, metres`, hint),
    stored: (one) => choice(one.title, stored(one).map((/** @type {Item} */ { id, name }) => [id, name])),
    brought: (one) =>
      broughtAs(one, stored(one), signal, {
        look: (id, stop) => looked({ of: one.look, id, board: board.read() }, stop),
      }),
  };
  const own = described.filter(({ kind }) => kind in kinds).map((one) => [one.name, kinds[one.kind](one)]);
  /** @type {Record<string, WayField>} */
  const made = describedFields(described, Object.fromEntries(own));
  return made;
}

/** A look at something that was brought. @param {Record<string, string>} asked @param {AbortSignal} signal */
function looked(asked, signal) {
  return api(`/api/calibration/look?${new URLSearchParams(asked)}`, { signal });
}

/** Say what is still to be brought, before anything is sent.
 *  @param {WayDescribed} way @param {{object: string, [key: string]: any}} said */
function refuseMissing(way, said) {
  const needed = way.parts.flatMap(({ fields }) => fields).filter(({ kind }) => ["stored", "brought"].includes(kind));
  const lacking = needed.filter(({ name }) => !said[name]).map(({ title }) => title.replace(/^The/, "the"));
  if (!said.object) lacking.unshift("the object");
  if (said.place?.points.length < 3) lacking.push("three corners of the board");
  if (lacking.length) throw missing(`Still missing: ${lacking.join(", ")}.`);
}

function meshHint() {
  const film = h("a", { href: "#/scan" }, "make it from a film");
  return hintLine("Not there yet? ", h("a", { href: "#/" }, "Bring its mesh"), " or ", film, ".");
}
