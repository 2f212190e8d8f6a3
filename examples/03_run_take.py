"""Make the motion of the person who moved the object: a phone's log, a mesh and a mount in, a result out.

Usage: python examples/03_run_take.py [OUTPUT]

Writes the result folder OUTPUT/motion (example_output/motion) of the demonstration take. The other
examples go on from it.
"""

import sys
from pathlib import Path

import numpy as np

from capture_app import InputError, RunRequest, run_take
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")

request = RunRequest(
    session=DEMO / SESSION,
    object=DEMO / MESH,
    mount=DEMO / MOUNT,
    output=out / "motion",
    samples=4,
    seed=0,
    height=1.72,
    video_size=None,
    replace=True,
)
try:
    result = run_take(
        request, progress=lambda stage, done: print(f"{stage:8} {done:4.0%}", end="\r")
    )
except InputError as problem:
    sys.exit(f"The take is refused: {problem}")

person = result.best
moved = np.linalg.norm(np.diff(person.root[:, :2], axis=0), axis=1).sum()
print(f"{len(result.motions)} samples of {len(person.root) / 30:.1f} s in {result.folder}")
print(f"Joints (frames, joints, xyz): {person.joints.shape}; the person walked {moved:.1f} m")
print(
    f"Hands hold the object in {(person.hand_contact > 0.5).any(axis=1).mean():.0%} of the frames"
)
for sample, scores in enumerate(result.manifest.scores):
    mark = "*" if sample == result.manifest.chosen else " "
    print(f"{mark} sample {sample + 1}: faults {scores['total']:.2f}")
for note in (*result.manifest.notes, *result.manifest.faults):
    print(f"Note: {note}")
