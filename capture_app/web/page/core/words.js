// Numbers and states as people say them.

const UNITS = ["bytes", "kB", "MB", "GB", "TB"];
const AGO = new Intl.RelativeTimeFormat("en", { numeric: "auto" });
/** @type {[Intl.RelativeTimeFormatUnit, number][]} */
const STEPS = [["day", 86400], ["hour", 3600], ["minute", 60]];

/** 1536 -> "1.5 kB". @param {number} bytes */
export function size(bytes) {
  let power = 0;
  while (power < UNITS.length - 1 && Math.round(bytes / 1000 ** power) >= 1000) power += 1;
  const value = bytes / 1000 ** power;
  return `${value.toFixed(value >= 99.95 || power === 0 ? 0 : 1)} ${UNITS[power]}`;
}

/** 83 -> "1 min 23 s". @param {number} seconds */
export function span(seconds) {
  if (seconds < 9.95) return `${seconds.toFixed(1)} s`;
  const whole = Math.round(seconds);
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  return `${Math.floor(whole / 3600)} h ${Math.floor((whole % 3600) / 60)} min`;
}

/** 1 -> "1 file", 2 -> "2 files".
 *  @param {number} number @param {string} one @param {string} many */
export function count(number, one, many = `${one}s`) {
  return `${number.toLocaleString("en")} ${number === 1 ? one : many}`;
}

/** "2 hours ago". @param {string} date */
export function ago(date) {
  const seconds = (Date.parse(date) - Date.now()) / 1000;
  const step = STEPS.find(([, length]) => Math.abs(seconds) >= length);
  if (!step) return "just now";
  if (step[0] === "day" && seconds < -14 * 86400) return new Date(date).toLocaleDateString("en-GB");
  return AGO.format(Math.round(seconds / step[1]), step[0]);
}

/** Metres -> "52 × 48 × 55 cm". @param {number[]} extents */
export function sides(extents) {
  const small = Math.max(...extents) < 0.1;
  const whole = extents.map((side) => Math.round(side * (small ? 1000 : 100)));
  return `${whole.join(" × ")} ${small ? "mm" : "cm"}`;
}

/** A stretch of a recording: [1.2, 3] -> "1.2 to 3.0 s"; times that its log does not tell are null.
 *  @param {(number | null)[]} seconds */
export function stretch(seconds) {
  const known = seconds.filter((time) => time !== null);
  return known.length ? `${known.map((time) => time.toFixed(1)).join(" to ")} s` : "";
}

/** "tracking" -> "Tracking". @param {string} text */
export function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** @type {Record<string, string>} */
export const STATES = {
  queued: "Waiting for its turn",
  running: "Working",
  cancelling: "Stopping",
  cancelled: "Cancelled",
  done: "Done",
  failed: "Failed",
};

/** @type {Record<string, string>} */
export const KINDS = {
  run: "Motion",
  resolve: "Correction",
  render: "Video",
  export: "Export",
  overlay: "Overlay",
  compare: "Comparison",
  calibrate: "Calibration",
  scan: "Object from a film",
};

/** @type {Record<string, string>} */
export const STAGES = {
  read: "Reading the recording",
  object: "Describing the object",
  hands: "Predicting the hands",
  contact: "Deciding which hand holds when",
  body: "Predicting the body",
  solve: "Putting the hands on the object",
  export: "Writing the files",
  video: "Drawing the video",
  board: "Finding the board in the film",
  localise: "Finding the camera in the scan",
  calibrate: "Working out the mount",
  look: "Looking at the film",
  frames: "Picking the sharpest pictures",
  features: "Finding what can be recognised",
  compare: "Comparing pictures",
  match: "Matching pictures",
  cameras: "Working out where the camera was",
  stereo: "Measuring the surface",
  silhouettes: "Finding its outlines",
  fusion: "Joining the surface",
  colours: "Colouring it",
  clean: "Cutting out the object",
  texture: "Painting its texture",
  report: "Writing the report",
};

/** Stages of a job in order, as far as they are known before it runs.
 *  @param {string} kind */
export function stagesOf(kind) {
  const run = ["read", "object", "hands", "contact", "body", "solve", "export"];
  const scan = [
    "look",
    "frames",
    "features",
    "match",
    "cameras",
    "stereo",
    "silhouettes",
    "fusion",
    "clean",
    "texture",
  ];
  /** @type {Record<string, string[]>} */
  const all = { run, resolve: ["read", "solve", "export"], scan };
  return all[kind] ?? [];
}

/** Whether a job will change by itself no more. @param {{state: string}} job */
export function ended(job) {
  return ["done", "failed", "cancelled"].includes(job.state);
}
