"""Correct which hand holds when and where, and solve the motion again where that touches it.

Usage: python examples/05_edit_contacts.py [OUTPUT]

Needs no network: what the correction does not touch stays as it was, to the last bit. Writes
OUTPUT/contacts.json and the result folder OUTPUT/corrected (in example_output).
"""

import json
import sys
from pathlib import Path

import numpy as np

from capture_app import ResolveRequest, RunRequest, load_result, resolve_result, run_take
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

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

# The left hand lets go half a second earlier, and holds the box 4 cm lower (its frame, metres).
contacts = json.loads((motion / "contacts.json").read_text())
last = [segment for segment in contacts["segments"] if segment["hand"] == "left"][-1]
last["stop"] -= 15
last["anchor"][2] -= 0.04
edited = out / "contacts.json"
edited.write_text(json.dumps(contacts, indent=2))

request = ResolveRequest(
    result=motion, contacts=edited, output=out / "corrected", video_size=None, replace=True
)
before, after = load_result(motion).best, resolve_result(request).best

palms = np.linalg.norm(after.joints[:, 22:] - before.joints[:, 22:], axis=-1)
changed = np.abs(after.rotations - before.rotations).max(axis=(1, 2, 3)) > 0
print(f"{changed.sum()} of {len(changed)} frames were solved again")
print(
    f"Left palm moved by up to {100 * palms[:, 0].max():.1f} cm, right {100 * palms[:, 1].max():.1f} cm"
)
print(f"The left hand is free from frame {last['stop']} on")
