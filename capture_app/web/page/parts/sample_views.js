// Small motions of samples: each person with the object, from above and from the side.
import { facingOf } from "/static/viewer/camera.js";
import { Motion } from "/static/viewer/motion.js";
import { point } from "/static/viewer/vectors.js";
/** @import {Pack} from "/static/viewer/pack.js" @import {Viewer} from "/static/viewer/viewer.js" */

const REACH = 1.3; // metres from the object to the edges of a picture
const BODY = 22; // joints without fingers
const POINTS = 300; // of the object's surface
const HEAD = 15;
const LEGIBLE = 56; // CSS pixels

/** A place of the world in a picture. @typedef {(place: ArrayLike<number>) => [number, number]} Seen */

/** Draw the samples of the first scene as time goes on; while it plays, one of them a frame.
 *  @param {HTMLCanvasElement[]} pictures one for each sample @param {Viewer} viewer */
export function drawSamples(pictures, viewer) {
  const pack = viewer.pack(0);
  if (!pack) return;
  const motion = new Motion(pack);
  const right = facingOf(motion);
  const surface = pointsOf(pack);
  let next = 0;
  let stale = 0;
  const draw = () => {
    do {
      motion.sample = next;
      drawSample(pictures[next], motion, viewer.time, { right, surface });
      next = (next + 1) % pictures.length;
      stale -= 1;
    } while (stale > 0 && !viewer.playing);
    if (stale > 0 && viewer.pack(0) === pack) requestAnimationFrame(draw);
  };
  const again = () => {
    if (stale <= 0) requestAnimationFrame(draw);
    stale = pictures.length;
  };
  viewer.addEventListener("time", again);
  viewer.addEventListener("unloaded", () => viewer.removeEventListener("time", again), { once: true });
  again();
}

/** Some points of the object's surface, in its own frame. @param {Pack} pack */
function pointsOf(pack) {
  const vertices = pack.array("object_vertices") ?? [];
  const step = 3 * Math.max(1, Math.floor(vertices.length / 3 / POINTS));
  const found = [];
  for (let v = 0; v < vertices.length; v += step) found.push(Array.from(vertices.slice(v, v + 3)));
  return found;
}

/** @param {HTMLCanvasElement} picture @param {Motion} motion @param {number} time
 *  @param {{right: number, surface: number[][]}} seen which way is right in the picture, radians */
function drawSample(picture, motion, time, { right, surface }) {
  const brush = picture.getContext("2d");
  const { clientWidth: width } = picture;
  const now = motion.at(time);
  if (!brush || !width || !now.joints) return;
  const ratio = devicePixelRatio;
  const half = width / 2;
  [picture.width, picture.height] = [width * ratio, half * ratio];
  brush.scale(ratio, ratio);
  const { object } = now;
  const places = object ? surface.map((place) => point(object, place)) : [];
  const [x, y] = object ? [object[12], object[13]] : now.joints;
  const [c, s] = [Math.cos(right), Math.sin(right)];
  const metre = half / (2 * REACH);
  /** @type {(place: ArrayLike<number>) => number} */
  const across = (p) => half / 2 + metre * ((p[0] - x) * c + (p[1] - y) * s);
  /** @type {Seen[]} */
  const views = [
    (p) => [across(p), half / 2 + metre * ((p[0] - x) * s - (p[1] - y) * c)],
    (p) => [half + across(p), half - 6 - metre * p[2]],
  ];
  const style = getComputedStyle(picture);
  /** @param {string} name */
  const ink = (name) => style.getPropertyValue(name);
  for (const [k, view] of views.entries()) {
    brush.save();
    brush.beginPath();
    brush.rect(k * half, 0, half - 1, half);
    brush.clip();
    brush.fillStyle = ink("--lane-ground");
    brush.fillRect(k * half, 0, half - 1, half);
    brush.fillStyle = ink("--two");
    for (const place of places.map(view)) brush.fillRect(place[0] - 1, place[1] - 1, 2, 2);
    brush.strokeStyle = brush.fillStyle = ink("--one");
    drawPerson(brush, motion, view);
    brush.fillStyle = ink("--quiet");
    brush.font = "11px system-ui, sans-serif";
    // In a small picture the word would lie on the person.
    if (half > LEGIBLE) brush.fillText(k ? "side" : "above", k * half + 4, 12);
    brush.restore();
  }
}

/** @param {CanvasRenderingContext2D} brush @param {Motion} motion at its moment @param {Seen} view */
function drawPerson(brush, { joints, header }, view) {
  /** @param {number} j */
  const at = (j) => view(joints.subarray(3 * j, 3 * j + 3));
  brush.lineWidth = 2;
  brush.beginPath();
  for (let j = 1; j < BODY; j++) {
    brush.moveTo(...at(header.joint_parents[j]));
    brush.lineTo(...at(j));
  }
  brush.stroke();
  brush.beginPath();
  brush.arc(...at(HEAD), 4, 0, 2 * Math.PI);
  brush.fill();
}
