"""Generate the person while the object's poses still arrive: finished frames come out block by block.

Usage: python examples/04_stream.py [OUTPUT]

Plays the demonstration take as if its phone were sending now, and writes the joints of the person into
OUTPUT/streamed.npy (example_output/streamed.npy).
"""

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from capture_app import (
    GenerationOptions,
    load_body,
    load_mesh,
    load_mount,
    load_stages,
    read_session,
    stream,
    to_object_motion,
)
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
out.mkdir(parents=True, exist_ok=True)

mesh, mount = load_mesh(DEMO / MESH), load_mount(DEMO / MOUNT)
take = to_object_motion(read_session(DEMO / SESSION), mesh, mount)
arrived = 0


def poses() -> Iterator[np.ndarray]:
    """T_world_object (4, 4) at 30 fps, world z up with the floor at 0; a live source would wait here."""
    global arrived
    for pose in take.motion.T_world_object:
        arrived += 1
        yield pose


began, joints = time.perf_counter(), list[np.ndarray]()
options = GenerationOptions(samples=1, steps=6)
for block in stream(mesh, poses(), load_body(), load_stages(), options):
    human = block.people[0].human
    joints.append(human.joints)
    stop = block.first + len(human.root)
    held = (human.hand_contact > 0.5).mean(axis=0)
    print(
        f"{time.perf_counter() - began:5.1f} s: frames {block.first:3} to {stop - 1:3} are finished, "
        f"{arrived} poses have arrived; left, right hand hold in {held[0]:.0%}, {held[1]:.0%}"
    )
np.save(out / "streamed.npy", np.concatenate(joints))
print(f"Joints (frames, 24, xyz) in metres: {out / 'streamed.npy'}")
