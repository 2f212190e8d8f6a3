"""Find where the phone sits on the object, by a tracker that followed the object while the phone logged.

Usage: python examples/02_calibrate_mount.py [OUTPUT]

The simulated phone is clamped to a box that is turned about by hand for twelve seconds; motion capture
follows the box. Writes recording/, tracker.txt and mount.json into OUTPUT (example_output), and compares
the mount with the true one.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app import TrackerWay, calibrate, load_mount
from capture_app.simulator.demo_take import box_mesh, clamped_phone, write_recording
from capture_app.simulator.simulated_phone import simulate
from omomo_core.motion import ObjectMotion

out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
out.mkdir(parents=True, exist_ok=True)

# What the two devices record: the phone its poses, the tracker t x y z qx qy qz qw of the object.
seconds = np.arange(12 * 30) / 30
ease = np.clip(np.minimum(seconds, seconds[-1] - seconds), 0, 1)[:, None] ** 2
waves = ease * np.sin(2 * np.pi * np.outer(seconds, [0.31, 0.23, 0.41, 0.27, 0.37, 0.19]))
T = np.tile(np.eye(4), (len(seconds), 1, 1))
T[:, :3, :3] = Rotation.from_rotvec(waves[:, :3] * [0.6, 0.5, 0.9]).as_matrix()
T[:, :3, 3] = waves[:, 3:] * 0.2 + [0, 0, 0.9]
motion = ObjectMotion(box_mesh(), T, np.ones(len(T), bool))
write_recording(simulate(motion, clamped_phone(), seed=1), out / "recording")
quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat()
np.savetxt(out / "tracker.txt", np.column_stack([np.arange(len(T)) / 30, T[:, :3, 3], quaternions]))

# The clocks of the two need not agree: how much they differ is found too.
way = TrackerWay(session=out / "recording", poses=out / "tracker.txt")
calibrate(way, out / "mount.json")

mount, true = load_mount(out / "mount.json"), clamped_phone()
error = np.linalg.inv(true.T_phone_object) @ mount.T_phone_object
turned = Rotation.from_matrix(error[:3, :3]).magnitude()
print(f"Method: {mount.method}; residuals: {mount.residuals}")
print(f"T_phone_object:\n{mount.T_phone_object.round(4)}")
print(
    f"Off the truth by {1e3 * np.linalg.norm(error[:3, 3]):.2f} mm, {np.degrees(turned):.3f} degrees"
)
