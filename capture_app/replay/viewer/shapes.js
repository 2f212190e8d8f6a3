// Small shapes: a ball, the phone, and the lines of what it sees.

/** @import {Lens} from "./pack.js" */

export function ball(rows = 10, columns = 18) {
  const points = [];
  const faces = [];
  for (let r = 0; r <= rows; r++) {
    for (let c = 0; c < columns; c++) {
      const lat = Math.PI * (r / rows - 0.5);
      const lon = (2 * Math.PI * c) / columns;
      points.push(Math.cos(lat) * Math.cos(lon), Math.cos(lat) * Math.sin(lon), Math.sin(lat));
      if (r === rows) continue;
      const here = r * columns + c;
      const beside = r * columns + ((c + 1) % columns);
      faces.push(here, beside, beside + columns, here, beside + columns, here + columns);
    }
  }
  const vertices = new Float32Array(points);
  return { vertices, normals: vertices, faces: new Uint16Array(faces) };
}

// In the axes of its camera (landscape picture: x right, y up, z to the viewer), metres.
const PHONE_LOW = [-0.02, -0.055, -0.002];
const PHONE_HIGH = [0.127, 0.016, 0.006];

export function phone() {
  const vertices = [];
  const normals = [];
  const faces = [];
  for (let axis = 0; axis < 3; axis++) {
    for (const side of [0, 1]) {
      const first = vertices.length / 3;
      const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
      for (const [a, b] of [[0, 0], [1, 0], [1, 1], [0, 1]]) {
        const corner = [0, 0, 0];
        corner[axis] = [PHONE_LOW, PHONE_HIGH][side][axis];
        corner[u] = [PHONE_LOW, PHONE_HIGH][a][u];
        corner[v] = [PHONE_LOW, PHONE_HIGH][b][v];
        vertices.push(...corner);
        normals.push(...[0, 1, 2].map((k) => (k === axis ? 2 * side - 1 : 0)));
      }
      const turn = side ? [0, 1, 2, 0, 2, 3] : [0, 2, 1, 0, 3, 2];
      faces.push(...turn.map((k) => first + k));
    }
  }
  return {
    vertices: new Float32Array(vertices),
    normals: new Float32Array(normals),
    faces: new Uint16Array(faces),
  };
}

/** From the camera to the corners of its picture `depth` metres ahead, and around them.
 *  @param {Lens | null} lens @param {number} depth */
export function frustum(lens, depth) {
  const y = depth * Math.tan((lens?.fov_y ?? 0.9) / 2);
  const x = y * (lens?.aspect ?? 4 / 3);
  const corners = [[-x, -y, -depth], [x, -y, -depth], [x, y, -depth], [-x, y, -depth]];
  return corners.flatMap((corner, k) => [[[0, 0, 0], corner], [corner, corners[(k + 1) % 4]]]);
}
