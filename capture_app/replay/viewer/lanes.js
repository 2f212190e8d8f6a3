// The lanes of a timeline that are only looked at: misses, depth in the object, tracking, speed.

import { bandLane, curveLane } from "./curves.js";
import { Motion } from "./motion.js";
/** @import {Lane} from "./curves.js"
 *  @import {Bytes, Pack} from "./pack.js" */

const TRACKING = ["good", "limited", "lost"];
const FULL_MISS = 0.05; // metres that fill the lane of misses at least
const FULL_SPEED = 0.5; // m/s

/** @param {Pack} pack @param {number} sample @returns {(Lane & {name: string})[]} */
export function lanesOf(pack, sample) {
  return [...ofBody(pack, sample), ...ofPhone(pack)];
}

/** @param {Pack} pack @param {number} sample */
function ofBody(pack, sample) {
  const motion = new Motion(pack);
  motion.sample = sample;
  const [left, right] = [0, 1].map((hand) => motion.series("palm_miss", 2, hand));
  const inside = motion.series("inside");
  if (!left || !right || !inside) return [];
  const off = left.map((value, f) => Math.max(value, right[f]));
  const about = { top: FULL_MISS, unit: "cm" };
  const miss = curveLane({ ...about, values: off, kind: "tl-one", label: "Palm off its place" });
  const deep = curveLane({ ...about, values: inside, kind: "tl-two", label: "Body in the object" });
  return [{ name: "Palm off", ...miss }, { name: "Inside", ...deep }];
}

/** @param {Pack} pack */
function ofPhone(pack) {
  const states = pack.array("tracking");
  if (!states) return [];
  const band = bandLane({ states, names: TRACKING, label: tracked(states) });
  const values = pack.need("phone_speed");
  const about = { top: FULL_SPEED, unit: "m/s", kind: "tl-one" };
  const speed = curveLane({ ...about, values, label: "Speed of the phone" });
  return [{ name: "Tracking", ...band }, { name: "Speed", ...speed }];
}

/** @param {Bytes} states */
function tracked(states) {
  const good = states.filter((state) => state === 0).length / states.length;
  return `Tracking is good in ${Math.round(100 * good)} % of the take`;
}
