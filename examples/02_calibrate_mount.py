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
from capture_app.simulator.demo_take import clamped_phone, write_recording
from capture_app.simulator.phone import simulate
from capture_app.simulator.wiggle import wiggle_motion

out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
out.mkdir(parents=True, exist_ok=True)

# What the two devices record: the phone its poses, the tracker t x y z qx qy qz qw of the object.
motion = wiggle_motion(seconds=12.0)
write_recording(simulate(motion, clamped_phone(), seed=1), out / "recording")
T = motion.T_world_object
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
