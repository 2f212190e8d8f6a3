// The ways that need a recording: which parts each has, and what it orders.
import { folded, h } from "../core/dom.js";
import { brought } from "../parts/brought.js";
import { choice, number } from "../parts/fields.js";
import { todo } from "./board.js";
import { cameraFields, matrixField } from "./camera.js";
import { boardParts, looker, recording, stepsOf } from "./parts.js";
import { recordedForm } from "./recorded.js";

export const board = recordedForm((context) => {
  const steps = stepsOf(context, "board");
  const printed = boardParts(context, steps, () => film?.lookAgain());
  const log = recording(context, { look: "turned" });
  const film = brought({
    label: "The film",
    kind: "video",
    items: [...context.videos, ...context.sessions],
    title: "Drop the second camera's film here",
    text: "A video (MP4, MOV), or choose a second phone's recording above.",
    accept: ".mp4,.mov,.m4v",
    signal: context.signal,
    look: looker("film", () => ({ board: printed.text() })),
  });
  const camera = cameraFields();
  return {
    name: "Mount by board",
    parts: [
      ...printed.parts,
      { title: "Record", content: [todo(steps["Record"]), log.node] },
      {
        title: "The film",
        content: [film.node, folded("I know the second camera's numbers", camera.node)],
      },
    ],
    show: printed.show,
    read: () => ({
      method: "board",
      session: log.read(),
      film: film.read(),
      camera: camera.read(),
      ...printed.read(),
    }),
  };
});

export const filmed = recordedForm((context) => {
  const steps = stepsOf(context, "filmed");
  const printed = boardParts(context, steps, () => log?.lookAgain());
  const log = recording(context, { look: "filmed", more: () => ({ board: printed.text() }) });
  return {
    name: "Mount by board and phone",
    parts: [...printed.parts, { title: "Record", content: [todo(steps["Record"]), log.node] }],
    show: printed.show,
    read: () => ({ method: "session", session: log.read(), ...printed.read() }),
  };
});

export const meshed = recordedForm((context) => {
  const steps = stepsOf(context, "meshed");
  const log = recording(context, { look: "rested" });
  const scan = brought({
    label: "The mesh of the recording",
    kind: "material",
    items: context.materials,
    title: "Drop the mesh that the app made in that recording",
    text: "OBJ, PLY or GLB, not turned and not cropped; a folder if more belongs to it.",
    folder: true,
    signal: context.signal,
  });
  return {
    name: "Mount by scan and phone",
    parts: [
      { title: "Record", content: [todo(steps["Record"]), log.node] },
      { title: "The scan", content: [todo(steps["The scan"]), scan.node] },
    ],
    read: () => ({ method: "session", session: log.read(), scan: scan.read() }),
  };
});

export const scan = recordedForm((context) => {
  const steps = stepsOf(context, "scan");
  const log = recording(context, { look: "still" });
  const model = brought({
    label: "The model of the scan",
    kind: "material",
    items: context.materials,
    title: "Drop a COLMAP model with its pictures",
    text: "The folder that holds sparse and images; only if the object was scanned elsewhere.",
    folder: true,
    signal: context.signal,
  });
  const matrix = matrixField(
    "From the model into the mesh's frame: four rows of four numbers",
    "Its rotation may be scaled. Empty: the model is in the mesh's frame, in metres.",
  );
  return {
    name: "Mount by scan",
    parts: [
      { title: "Record", content: [todo(steps["Record"]), log.node] },
      {
        title: "The scan",
        content: [
          h("p", {}, "An object that was made here from a film brings its pictures along: nothing is to be done."),
          folded("The object was scanned elsewhere", [model.node, matrix.node]),
        ],
      },
    ],
    read: () => ({
      method: "scan",
      session: log.read(),
      model: model.read(),
      model_to_object: matrix.read(),
    }),
  };
});

export const tracker = recordedForm((context) => {
  const steps = stepsOf(context, "tracker");
  const log = recording(context, { look: "turned" });
  const poses = brought({
    label: "The tracker's log",
    kind: "material",
    items: context.materials,
    title: "Drop the tracker's log here",
    text: "Lines of t x y z qx qy qz qw.",
    accept: ".csv,.txt,.tum",
    signal: context.signal,
    look: looker("poses"),
  });
  const body = matrixField(
    "Its pose on the mesh: four rows of four numbers, metres",
    "Maps points of the tracked body into the mesh's frame.",
  );
  return {
    name: "Mount by tracker",
    parts: [
      { title: "Record", content: [todo(steps["Record"]), log.node] },
      {
        title: "The tracker's log",
        content: [
          todo(steps["The tracker's log"]),
          poses.node,
          folded("The tracked body does not have the mesh's frame", body.node),
        ],
      },
    ],
    read: () => ({ method: "tracker", session: log.read(), poses: poses.read(), body: body.read() }),
  };
});

export const floor = recordedForm((context) => {
  const log = recording(context, {});
  const mount = choice("The mount to be made surer", context.mounts.map(({ id, name }) => [id, name]));
  const height = number("From the floor up to the lens, where the object first rests", {
    unit: "m",
    min: 0.01,
    max: 5,

    hint: "With a tape. Empty: the height is taken from depth maps, or stays as it was.",
  });
  return {
    name: "Mount, refined by the floor",
    parts: [
      { title: "The mount so far", content: [mount.node] },
      {
        title: "Record",
        content: [
          todo([
            "Any recording with the phone clamped as before will do, in which the object stands on " +
              "the floor on a side of its own for two seconds; on several sides is better.",
          ]),
          log.node,
          height.node,
        ],
      },
    ],
    read: () => ({
      method: "floor",
      mount: mount.read() ?? null,
      session: log.read(),
      phone_height: height.read(),
    }),
  };
});
