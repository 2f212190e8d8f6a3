"""Read what a phone logged, and look the take over before any time is spent on it.

Usage: python examples/01_read_session.py [SESSION]
SESSION is a folder, file or archive that a phone app wrote; the demonstration take if it is not given.
"""

import sys
from pathlib import Path

import numpy as np

from capture_app import inspect_take, read_session
from capture_app.simulator.demo_take import DEMO, SESSION

path = Path(sys.argv[1]) if len(sys.argv) > 1 else DEMO / SESSION
session = read_session(path)

seconds = session.times[-1] - session.times[0]
way = np.linalg.norm(np.diff(session.T_world_phone[:, :3, 3], axis=0), axis=1).sum()
print(f"App:      {session.app}")
print(f"Length:   {seconds:.1f} s, {way:.1f} m")
print(f"Rate:     {(len(session.times) - 1) / seconds:.1f} poses a second")
if session.tracking_ok is None:
    print("Tracking: not logged by this app")
else:
    print(f"Tracking: {session.tracking_ok.mean():.0%} of the poses")
if session.intrinsics is not None and session.image_size is not None:
    fx, fy, cx, cy = session.intrinsics.mean(axis=0)
    width, height = session.image_size
    print(f"Camera:   {width} x {height} pixels, focal length {fx:.0f}, {fy:.0f}")
    view = np.degrees(2 * np.arctan(width / 2 / fx))
    print(f"          centre {cx:.0f}, {cy:.0f}; {view:.0f} degrees wide")

seen = inspect_take(path)
print(f"Verdict:  {seen.verdict}" + (f" ({seen.reason})" if seen.reason else ""))
for check in seen.report.checks:
    print(f"  {check.severity:4} {check.name}: {check.message}")
