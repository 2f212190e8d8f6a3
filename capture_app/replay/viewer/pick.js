// The point of an object's surface that a ray meets first, and that of the floor.

import { add, cross, direction, dot, point, rigidInverse, scaled, sub, unit } from "./vectors.js";
/** @import {Matrix, Vector} from "./vectors.js"
 *  @import {Pack} from "./pack.js" */

/** @typedef {{origin: number[], toward: number[]}} Ray */
/** @typedef {NonNullable<ReturnType<typeof pickObject>>} Picked */

const PALM_OFFSET = 0.02; // metres between a surface and the palm joint of a hand that holds it

/** T_world_object is where the object is; the ray is in the world.
 *  @param {Pack} pack @param {Matrix} T_world_object @param {Ray} ray */
export function pickObject(pack, T_world_object, { origin, toward }) {
  const vertices = pack.array("object_vertices");
  if (!vertices) return null;
  const T_object_world = rigidInverse(T_world_object);
  const from = point(T_object_world, origin);
  const along = direction(T_object_world, toward);
  const hit = nearest(vertices, pack.need("object_faces"), from, along);
  if (!hit) return null;
  const at = add(from, scaled(along, hit.distance));
  const normal = dot(hit.normal, along) > 0 ? scaled(hit.normal, -1) : hit.normal;
  return {
    kind: "object",
    distance: hit.distance,
    point_object: at,
    normal_object: normal,
    anchor: add(at, scaled(normal, PALM_OFFSET)),
  };
}

/** Where a ray from above meets the floor; null where it goes up. @param {Ray} ray */
export function onFloor({ origin, toward }) {
  if (origin[2] <= 0 || toward[2] >= 0) return null;
  const [x, y] = add(origin, scaled(toward, -origin[2] / toward[2]));
  return [x, y, 0];
}

/** Möller and Trumbore's test of a ray and a triangle (Journal of Graphics Tools 2, 1997).
 *  @param {Vector} vertices @param {Vector} faces @param {number[]} from @param {number[]} along */
function nearest(vertices, faces, from, along) {
  /** @type {{distance: number, normal: number[]} | null} */
  let best = null;
  /** @param {number} index */
  const corner = (index) => [vertices[3 * index], vertices[3 * index + 1], vertices[3 * index + 2]];
  for (let f = 0; f < faces.length; f += 3) {
    const a = corner(faces[f]);
    const ab = sub(corner(faces[f + 1]), a);
    const ac = sub(corner(faces[f + 2]), a);
    const p = cross(along, ac);
    const det = dot(ab, p);
    if (Math.abs(det) < 1e-14) continue;
    const s = sub(from, a);
    const u = dot(s, p) / det;
    if (u < 0 || u > 1) continue;
    const q = cross(s, ab);
    const v = dot(along, q) / det;
    if (v < 0 || u + v > 1) continue;
    const distance = dot(ac, q) / det;
    if (distance > 1e-6 && (!best || distance < best.distance)) {
      best = { distance, normal: unit(cross(ab, ac)) };
    }
  }
  return best;
}
