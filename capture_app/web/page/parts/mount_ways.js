// The ways that need a recording: what each needs, and the command.
import { h } from "../core/dom.js";
import { doing } from "./fields.js";

const WAYS = [
  [
    "Be guided",
    "It asks what you have, tells what to record, and looks at each recording at once.",
    "omocap calibrate",
  ],
  [
    "Board and a second camera",
    "Fix a printed board on the object, film it from a tripod while the clamped " +
      "phone logs, turn the object for 20 seconds. Millimetres and tenths of a degree.",
    "omocap calibrate board --help",
  ],
  [
    "One recording",
    "Scan the object with the phone, then clamp it without stopping the log or moving the object.",
    "omocap calibrate session --help",
  ],
  [
    "A scan that shows the phone",
    "Two seconds at rest, and a scan of the object with the room around it.",
    "omocap calibrate scan --help",
  ],
  [
    "Pictures of the screen",
    "The phone shows a board on its screen; photograph it and the object together.",
    "omocap calibrate screen --help",
  ],
  [
    "Motion capture",
    "A tracker is on the object and follows the same motion as the phone.",
    "omocap calibrate tracker --help",
  ],
  [
    "Standing on the floor",
    "Makes any mount better, from a recording in which the object stands on the floor.",
    "omocap calibrate floor --help",
  ],
];

export function otherWays() {
  return h(
    "div",
    { class: "stack" },
    h(
      "p",
      {},
      "These are commands to be run in a terminal on this computer. Each writes a " +
        "mount.json; drop it where the recording asks for the mount.",
    ),
    h(
      "ul",
      { class: "ways" },
      WAYS.map(([title, text, command]) =>
        h(
          "li",
          { class: "card" },
          h("h2", { class: "small" }, title),
          h("p", { class: "hint" }, text),
          h("div", { class: "command" }, h("code", {}, command), copy(command)),
        ),
      ),
    ),
  );
}

function copy(command) {
  const button = doing(
    "Copy",
    async () => {
      await navigator.clipboard.writeText(command);
      button.textContent = "Copied";
    },
    { kind: "quiet" },
  );
  button.setAttribute("aria-label", `Copy: ${command}`);
  return button;
}
