import assert from "node:assert/strict";
import test from "node:test";

import { Motion } from "../../capture_app/replay/viewer/motion.js";
import { readPack } from "../../capture_app/replay/viewer/pack.js";
import { point } from "../../capture_app/replay/viewer/vectors.js";
import { HEADER, packed } from "./made_pack.js";
import { near } from "./near.js";

const SAME = [0, 0, 0, 1];
const QUARTER_ABOUT_Z = [0, 0, Math.SQRT1_2, Math.SQRT1_2];
const ONE = 32767;

/** A phone that goes 1 m a frame along x and turns by a quarter in the last step. */
function phoneTake(tracking = [0, 0, 0]) {
  return new Motion(
    readPack(
      packed(
        { ...HEADER, samples: 0 },
        {
          phone_position: { dtype: "f4", shape: [3, 3], values: [0, 0, 1, 1, 0, 1, 2, 0, 1] },
          phone_rotation: {
            dtype: "f4",
            shape: [3, 4],
            values: [...SAME, ...SAME, ...QUARTER_ABOUT_Z],
          },
          tracking: { dtype: "u1", shape: [3], values: tracking },
        },
      ),
    ),
  );
}

/** Two samples of a body of three joints in a row along x, each 1 m from the last; its root rises by
 *  a metre a frame, 10 m higher in the second sample; the middle joint is turned by a quarter. */
function body() {
  const quarter = [0, 0, 23170, 23170];
  const still = [0, 0, 0, ONE];
  const pose = [...still, ...quarter, ...quarter];
  const rises = [0, 1, 2].flatMap((z) => [0, 0, z]);
  const header = {
    ...HEADER,
    samples: 2,
    joint_names: ["pelvis", "left_middle1", "right_middle1"],
    joint_parents: [-1, 0, 1],
    contacts: [[{ hand: "left", start: 0, stop: 2 }]],
  };
  return new Motion(
    readPack(
      packed(header, {
        root: {
          dtype: "f4",
          shape: [2, 3, 3],
          values: [...rises, ...rises.map((v) => v && v + 10)],
        },
        rotations: { dtype: "i2", shape: [2, 3, 3, 4], values: Array(6).fill(pose).flat() },
        rest_joints: { dtype: "f4", shape: [3, 3], values: [5, 6, 4, 6, 6, 4, 7, 6, 4] },
        hand_contact: {
          dtype: "u1",
          shape: [2, 3, 2],
          values: [255, 0, 255, 51, 0, 0, 0, 255, 0, 255, 0, 255],
        },
        palm_miss: {
          dtype: "f4",
          shape: [2, 3, 2],
          values: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
        },
      }),
    ),
  );
}

const placeOf = (T) => point(T, [0, 0, 0]);

test("a take lasts from its first frame to its last", () => {
  near([phoneTake().duration], [0.2]);
});

test("between two frames things are between their places", () => {
  near(placeOf(phoneTake().at(0.05).phone), [0.5, 0, 1]);
  near(placeOf(phoneTake().at(0.1).phone), [1, 0, 1]);
  near(point(phoneTake().at(0.15).phone, [1, 0, 0]), [1.5 + Math.SQRT1_2, Math.SQRT1_2, 1]);
});

test("before the start and after the end things stay where they were", () => {
  near(placeOf(phoneTake().at(-1).phone), [0, 0, 1]);
  near(placeOf(phoneTake().at(99).phone), [2, 0, 1]);
  assert.equal(phoneTake().at(99).frame, 2);
});

test("the nearest frame is the one that is told", () => {
  assert.deepEqual(
    [0, 0.04, 0.06, 0.1, 0.16].map((time) => phoneTake().at(time).frame),
    [0, 0, 1, 1, 2],
  );
});

test("a pose that tracking lost is not mixed with its neighbours", () => {
  const take = phoneTake([0, 2, 0]);
  near(placeOf(take.at(0.04).phone), [0, 0, 1]);
  near(placeOf(take.at(0.06).phone), [1, 0, 1]);
  near(placeOf(take.at(0.14).phone), [1, 0, 1]);
});

test("a take without a person or an object has neither", () => {
  const now = phoneTake().at(0);
  assert.deepEqual(
    [now.bones, now.joints, now.object, now.palms, now.held],
    [null, null, null, [], []],
  );
  assert.equal(now.valid, true);
});

test("joints hang on their parents as these are turned", () => {
  const { joints } = body().at(0.1);
  near(joints.subarray(0, 9), [0, 0, 1, 1, 0, 1, 1, 1, 1], 1e-4);
});

test("a bone brings what is at rest around a joint to where the joint has turned it", () => {
  const { bones, joints } = body().at(0.2);
  const joint = Array.from(joints.subarray(6, 9));
  const bring = (vertex) =>
    [0, 1, 2].map((row) => {
      const [a, b, c, d] = bones.subarray(24 + 4 * row, 28 + 4 * row);
      return a * vertex[0] + b * vertex[1] + c * vertex[2] + d;
    });
  near(bring([7, 6, 4]), joint, 1e-4);
  // A quarter turn about z brings x to y and y to -x.
  near(bring([7.3, 6.1, 4.2]), [joint[0] - 0.1, joint[1] + 0.3, joint[2] + 0.2], 1e-4);
});

test("an object's pose that is a guess is told, and not mixed with its neighbours", () => {
  const motion = new Motion(
    readPack(
      packed(
        { ...HEADER, samples: 0 },
        {
          object_position: { dtype: "f4", shape: [3, 3], values: [0, 0, 0, 1, 0, 0, 2, 0, 0] },
          object_rotation: { dtype: "f4", shape: [3, 4], values: [...SAME, ...SAME, ...SAME] },
          valid: { dtype: "u1", shape: [3], values: [1, 0, 1] },
        },
      ),
    ),
  );
  assert.deepEqual(
    [0, 0.1, 0.2].map((time) => motion.at(time).valid),
    [true, false, true],
  );
  near(placeOf(motion.at(0.03).object), [0, 0, 0]);
  near(placeOf(motion.at(0.08).object), [1, 0, 0]);
});

test("another sample is another motion, with hands and contacts of its own", () => {
  const motion = body();
  near(motion.at(0.1).held, [1, 0.2]);
  assert.equal(motion.contacts().length, 1);
  motion.sample = 1;
  near(motion.at(0.1).joints.subarray(0, 3), [0, 0, 11]);
  near(motion.at(0.1).held, [0, 1]);
  assert.deepEqual(motion.contacts(), []);
});

test("palms are the joints of that name", () => {
  near(body().at(0).palms.flat(), [1, 0, 0, 1, 1, 0], 1e-4);
});

test("a series holds one column of the sample that is shown", () => {
  const motion = body();
  assert.deepEqual(Array.from(motion.series("palm_miss", 2, 1)), [1, 3, 5]);
  motion.sample = 1;
  assert.deepEqual(Array.from(motion.series("palm_miss", 2, 0)), [6, 8, 10]);
  assert.equal(motion.series("inside"), null);
});

test("the middle of a stretch is the mean of its frames, cut at the ends", () => {
  near(body().centre(0.1, 0.1), [0, 0, 1]);
  near(body().centre(0, 0.1), [0, 0, 0.5]);
  near(body().centre(0.2, 0.1), [0, 0, 1.5]);
  near(phoneTake().centre(0.05, 0), [2, 0, 1]);
});

test("the middle of the first hold is found over a short pause, and near its beginning if it is long", () => {
  const held = (segments) =>
    new Motion(readPack(packed({ ...HEADER, contacts: [segments] }, {}))).heldAt() * HEADER.fps;
  const one = { hand: 0, start: 30, stop: 90 };
  assert.equal(held([]), 0);
  assert.equal(Math.round(held([{ hand: 1, start: 300, stop: 400 }, one])), 60);
  assert.equal(Math.round(held([one, { hand: 1, start: 120, stop: 150 }])), 90);
  assert.equal(Math.round(held([{ ...one, stop: 3000 }])), 180);
});
