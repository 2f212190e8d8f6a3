// From a point of the picture to the world and back: panes, cameras, picks.
import assert from "node:assert/strict";
import test from "node:test";

import { Camera, MODES, facingOf, ray } from "../../capture_app/replay/viewer/camera.js";
import { Motion } from "../../capture_app/replay/viewer/motion.js";
import { readPack } from "../../capture_app/replay/viewer/pack.js";
import { panesOf, pixels, projected } from "../../capture_app/replay/viewer/panes.js";
import { onFloor, pickObject } from "../../capture_app/replay/viewer/pick.js";
import {
  add,
  multiply,
  pose,
  rigidInverse,
  scaled,
} from "../../capture_app/replay/viewer/vectors.js";
import { HEADER, packed } from "./made_pack.js";
import { near } from "./near.js";

const CUBE = [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [k & 1, (k >> 1) & 1, k >> 2]);
const CUBE_FACES = [
  [0, 2, 1],
  [1, 2, 3],
  [4, 5, 6],
  [5, 7, 6],
  [0, 1, 4],
  [1, 5, 4],
  [2, 6, 3],
  [3, 6, 7],
  [0, 4, 2],
  [2, 4, 6],
  [1, 3, 5],
  [3, 7, 5],
];
const STILL = pose([0, 0, 0, 1], [0, 0, 0]);

/** A cube of 1 m that goes 2 m along x, seen by a phone that goes with it 3 m away. */
function scene() {
  const along = [0, 1, 2];
  const same = along.flatMap(() => [0, 0, 0, 1]);
  return readPack(
    packed(
      { ...HEADER, samples: 0, phone: { fov_y: 1, aspect: 4 / 3, turns: 0 } },
      {
        object_vertices: { dtype: "f4", shape: [8, 3], values: CUBE.flat() },
        object_faces: { dtype: "u2", shape: [12, 3], values: CUBE_FACES.flat() },
        object_position: { dtype: "f4", shape: [3, 3], values: along.flatMap((x) => [x, 0, 0]) },
        object_rotation: { dtype: "f4", shape: [3, 4], values: same },
        phone_position: { dtype: "f4", shape: [3, 3], values: along.flatMap((x) => [x, 0, 3]) },
        phone_rotation: { dtype: "f4", shape: [3, 4], values: same },
      },
    ),
  );
}

const PANE = { slot: 0, x: 100, y: 0, width: 400, height: 300 };
const inPane = (view, place, pane = PANE) =>
  projected(multiply(view.projection, rigidInverse(view.T_world_camera)), pane, place);

test("panes beside each other share the width; over each other each has all of it", () => {
  assert.deepEqual(
    panesOf([0, 2], "side", 800, 300).map(({ slot, x, width }) => [slot, x, width]),
    [
      [0, 0, 400],
      [2, 400, 400],
    ],
  );
  assert.deepEqual(
    panesOf([0, 2], "over", 800, 300).map(({ x, width }) => [x, width]),
    [
      [0, 800],
      [0, 800],
    ],
  );
  assert.deepEqual(panesOf([], "side", 800, 300), []);
});

test("panes leave no pixel between them, whatever the screen's ratio", () => {
  for (const ratio of [1, 1.25, 1.5, 2]) {
    const all = panesOf([0, 1, 2], "side", 1001, 300).map((pane) => pixels(pane, ratio));
    for (const [k, one] of all.slice(1).entries()) assert.equal(all[k].x + all[k].width, one.x);
    assert.equal(all[2].x + all[2].width, Math.round(1001 * ratio));
    assert.equal(all[0].height, 300 * ratio);
  }
});

test("what a ray through a pixel meets is seen at that pixel, by each camera", () => {
  const motion = new Motion(scene());
  for (const mode of MODES) {
    const camera = new Camera();
    camera.frame([motion]);
    camera.set(mode);
    camera.turn(0.3, 0.2);
    const view = camera.view(motion, 0.1, PANE.width / PANE.height);
    for (const [x, y] of [
      [0, 0],
      [0.7, -0.4],
      [-0.9, 0.9],
    ]) {
      const { origin, toward } = ray(view, x, y);
      const found = inPane(view, add(origin, scaled(toward, 2.5)));
      near([found.x, found.y], [100 + 200 * (x + 1), 150 * (1 - y)], 0.01);
      assert.ok(found.depth > 0);
    }
  }
});

test("a camera that frames a motion has all of it in its picture", () => {
  const motion = new Motion(scene());
  const camera = new Camera();
  camera.frame([motion]);
  for (const aspect of [2, 1, 0.5]) {
    const view = camera.view(motion, 0, aspect);
    const pane = { slot: 0, x: 0, y: 0, width: 300 * aspect, height: 300 };
    for (const corner of CUBE) {
      for (const far of [0, 2]) {
        const { x, y } = inPane(view, add(corner, [far, 0, 0]), pane);
        assert.ok(x >= 0 && x <= pane.width && y >= 0 && y <= 300, `${corner} at ${x}, ${y}`);
      }
    }
  }
});

test("a person is looked at from before", () => {
  // Hips along x, the left one ahead: the person looks along -y.
  const still = [0, 0, 0, 32767];
  const person = readPack(
    packed(
      {
        ...HEADER,
        frames: 1,
        joint_names: ["pelvis", "left_hip", "right_hip"],
        joint_parents: [-1, 0, 0],
      },
      {
        root: { dtype: "f4", shape: [1, 1, 3], values: [0, 0, 1] },
        rotations: { dtype: "i2", shape: [1, 1, 3, 4], values: [...still, ...still, ...still] },
        rest_joints: { dtype: "f4", shape: [3, 3], values: [0, 0, 0, 0.1, 0, 0, -0.1, 0, 0] },
        hand_contact: { dtype: "u1", shape: [1, 1, 2], values: [0, 0] },
      },
    ),
  );
  const motion = new Motion(person);
  const camera = new Camera();
  camera.frame([motion]);
  const { origin } = ray(camera.view(motion, 0, 1.5), 0, 0);
  assert.ok(-origin[1] > Math.abs(origin[0]), `seen from ${origin}`);
  assert.ok(origin[2] > 0.5);
});

test("a session is looked at from beside its way", () => {
  const pack = scene();
  const motion = new Motion({
    ...pack,
    array: (name) => (/phone/.test(name) ? pack.array(name) : null),
  });
  const camera = new Camera();
  camera.frame([motion]);
  const { origin } = ray(camera.view(motion, 0, 1.5), 0, 0);
  const [x, y] = origin.map((value, k) => value - camera.scene.centre[k]);
  assert.ok(Math.abs(y) > Math.abs(x), `seen from ${x}, ${y}`);
});

test("the object's camera shows all of the object, wherever it has gone", () => {
  const motion = new Motion(scene());
  const camera = new Camera();
  camera.frame([motion]);
  camera.set("object");
  const view = camera.view(motion, 0.2, 4 / 3);
  for (const corner of CUBE) {
    const { x, y } = inPane(view, add(corner, [2, 0, 0]));
    assert.ok(x > 100 && x < 500 && y > 0 && y < 300, `${corner} at ${x}, ${y}`);
  }
});

test("dragging lifts the eye until nearly above, and lowers it to a little below the middle", () => {
  const motion = new Motion(scene());
  const camera = new Camera();
  camera.frame([motion]);
  const height = () => ray(camera.view(motion, 0, 1.5), 0, 0).origin[2];
  const before = height();
  camera.turn(0, 0.3);
  assert.ok(height() > before);
  camera.turn(0, 99);
  const steep = ray(camera.view(motion, 0, 1.5), 0, 0).toward;
  assert.ok(steep[2] < -0.99 && steep[2] > -1);
  camera.turn(0, -99);
  assert.ok(height() < camera.scene.centre[2]);
});

test("the phone's camera is where the phone is and sees what it saw", () => {
  const motion = new Motion(scene());
  const camera = new Camera();
  camera.set("phone");
  const view = camera.view(motion, 0.1, 4 / 3);
  near(Array.from(view.T_world_camera.subarray(12, 15)), [1, 0, 3]);
  const top = inPane(view, [1, 3 * Math.tan(0.5), 0]);
  near([top.x, top.y], [300, 0], 0.01);
});

test("a camera comes no nearer than a hand's width and goes no farther than a street", () => {
  const motion = new Motion(scene());
  const camera = new Camera();
  camera.frame([motion]);
  const away = () => {
    const { origin } = ray(camera.view(motion, 0, 2), 0, 0);
    return Math.hypot(...camera.scene.centre.map((value, k) => value - origin[k]));
  };
  for (let k = 0; k < 200; k += 1) camera.closer(0.9);
  assert.ok(away() > 0.2 && away() < 0.4);
  for (let k = 0; k < 200; k += 1) camera.closer(1.1);
  assert.ok(away() > 40 && away() < 70);
});

test("there are no other cameras", () => {
  assert.throws(() => new Camera().set("sideways"), /no camera sideways/);
});

test("a ray meets the face that is nearest, with the normal towards its eye", () => {
  const found = pickObject(scene(), STILL, { origin: [0.3, 0.6, 5], toward: [0, 0, -1] });
  near([found.distance], [4]);
  near(found.point_object, [0.3, 0.6, 1]);
  near(found.normal_object, [0, 0, 1]);
  near(found.anchor, [0.3, 0.6, 1.02]);
});

test("from inside, the far wall is met, and its normal points inside", () => {
  const found = pickObject(scene(), STILL, { origin: [0.5, 0.5, 0.5], toward: [1, 0, 0] });
  near([found.distance], [0.5]);
  near(found.normal_object, [-1, 0, 0]);
});

test("a pick is told in the object's own axes", () => {
  const turned = pose([0, 0, Math.SQRT1_2, Math.SQRT1_2], [10, 0, 0]);
  const found = pickObject(scene(), turned, { origin: [9.7, 0.6, 5], toward: [0, 0, -1] });
  near(found.point_object, [0.6, 0.3, 1], 1e-5);
});

test("a ray that misses, or has the object behind it, meets nothing", () => {
  assert.equal(pickObject(scene(), STILL, { origin: [1.2, 0.5, 5], toward: [0, 0, -1] }), null);
  assert.equal(pickObject(scene(), STILL, { origin: [0.5, 0.5, 5], toward: [0, 0, 1] }), null);
  assert.equal(
    pickObject(readPack(packed(HEADER, {})), STILL, { origin: [0, 0, 5], toward: [0, 0, -1] }),
    null,
  );
});

test("the floor is met from above only, and below the horizon only", () => {
  near(onFloor({ origin: [1, 2, 3], toward: [1, 0, -1] }), [4, 2, 0]);
  assert.equal(onFloor({ origin: [1, 2, 3], toward: [1, 0, 0.1] }), null);
  assert.equal(onFloor({ origin: [1, 2, 3], toward: [1, 0, 0] }), null);
  assert.equal(onFloor({ origin: [1, 2, -1], toward: [0, 0, -1] }), null);
});

test("the front and the side are those of the person at that second, hands and feet come near", () => {
  const motion = new Motion(scene());
  const camera = new Camera();
  camera.frame([motion]);
  camera.set("front", motion, 0);
  const front = camera.yaw;
  near([front], [facingOf(motion, 0)]);
  camera.set("side", motion, 0);
  near([camera.yaw - front], [Math.PI / 2]);
  const far = farOf(camera.view(motion, 0, 1));
  for (const mode of ["hands", "feet"]) {
    camera.set(mode, motion, 0);
    assert.ok(farOf(camera.view(motion, 0, 1)) < 0.6 * far);
  }
});

/** How far the eye is from the floor under the world's origin.
 *  @param {import("../../capture_app/replay/viewer/camera.js").View} view */
function farOf({ T_world_camera: T }) {
  return Math.hypot(T[12], T[13], T[14]);
}
