"""Measure generated people against recorded ones, as the paper does.

Usage: python examples/08_evaluate.py [OUTPUT [CLIPS]]

CLIPS is a folder of recorded clips (docs/evaluation.md describes their layout). Without it a clip is
written to OUTPUT/clips from a generated motion, to show the layout; figures on it mean nothing.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app import GenerationOptions, RunRequest, evaluate, load_result, run_take
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from omomo_core.learning.evaluation.real_clips import NAMES

out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
clips = Path(sys.argv[2]) if len(sys.argv) > 2 else out / "clips"
motion = out / "motion"
if len(sys.argv) <= 2 and not clips.exists():
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
    result = load_result(motion)
    human, moved = result.best, result.object_motion
    # A clip's rest pose looks along x with z up, ours along z with y up.
    R_rest = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    turns = Rotation.from_matrix((human.rotations @ R_rest).reshape(-1, 3, 3)).as_quat()
    (clips / "meshes").mkdir(parents=True)
    np.savez(clips / "meshes" / "box.npz", vertices=moved.mesh.vertices, faces=moved.mesh.faces)
    np.savez(
        clips / "sub1_box_000.npz",
        joint_names=np.array(NAMES),
        joints=human.joints[:, :22],
        joint_rot_global_xyzw=turns.reshape(-1, 22, 4),
        palms=human.joints[:, 22:],
        obj_pos=moved.T_world_object[:, :3, 3],
        obj_rot_xyzw=Rotation.from_matrix(moved.T_world_object[:, :3, :3]).as_quat(),
    )

# The object alone is given, or where the person stood at first too; two samples of each.
given = ["predicted_palms", "predicted_palms_stood"]
options = GenerationOptions(samples=2)
evaluation = evaluate([clips], given, options)

for name, reason in evaluation.origin.skipped.items():
    print(f"Skipped {name}: {reason}")
print(f"{f'Mean of {len(evaluation.clips)} clips':24}palms  MPJPE  T_root (cm)   F1")
for protocol in given:
    one = evaluation.table()[protocol]["K1"]
    errors = "  ".join(f"{one[key]:5.1f}" for key in ("hand_jpe_cm", "mpjpe_cm", "t_root_cm"))
    print(f"{protocol:24}{errors}        {one['contact_f1']:.2f}")
