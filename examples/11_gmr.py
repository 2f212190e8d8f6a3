"""Give a motion to GMR, which moves a Unitree G1 with it; the model of SMPL-X is not needed.

Usage: python examples/11_gmr.py [OUTPUT]

Writes OUTPUT/gmr.csv (example_output/gmr.csv): a row for each frame of root x, y, z, quaternion (w first) and
joints. GMR scales the person and not the object; `omocap export --to robot` keeps the palms on the object.
"""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np

from capture_app import RunRequest, load_result, run_take
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

try:
    gmr = import_module("general_motion_retargeting")
except ImportError:
    sys.exit("GMR is not installed: pip install git+https://github.com/YanjieZe/GMR")

out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
motion = out / "motion"
if not motion.exists():
    run_take(
        RunRequest(
            session=DEMO / SESSION,
            object=DEMO / MESH,
            mount=DEMO / MOUNT,
            output=motion,
            video_size=None,
        )
    )

# Joints of the body have the names and the axes of SMPL-X; GMR expects quaternions with w first.
with np.load(motion / "motion.npz") as arrays:
    sample, names = int(arrays["chosen"]), arrays["rotation_names"].tolist()
    joints = arrays["joints"][sample].astype(float)
    turns = np.roll(arrays["rotations_xyzw"][sample].astype(float), 1, axis=-1)

height = load_result(motion).manifest.body.height
robot = gmr.GeneralMotionRetargeting(
    src_human="smplx", tgt_robot="unitree_g1", actual_human_height=height, verbose=False
)
qpos = np.array(
    [
        robot.retarget({name: (joints[t, j], turns[t, j]) for j, name in enumerate(names)})
        for t in range(len(joints))
    ]
)
np.savetxt(out / "gmr.csv", qpos, "%.6f", ",")

# The robot's pelvis goes the person's way, scaled about the origin.
pelvis, root = joints[:, 0], qpos[:, :3]
scale = (root * pelvis).sum() / (pelvis * pelvis).sum()
off = np.linalg.norm(root - scale * pelvis, axis=1).max()
print(f"{len(qpos)} frames of {qpos.shape[1] - 7} joints; the way is scaled by {scale:.2f}")
assert off < 0.1, f"the pelvis is {100 * off:.0f} cm off its way"
