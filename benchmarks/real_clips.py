"""The shipped weights on real recordings of people who move objects, never used in training.

    python benchmarks/real_clips.py CLIPS [--weights DIR] [--samples 20]

CLIPS holds npz clips (joint_names, joints (T,22,3), palms (T,2,3), obj_pos (T,3), obj_rot_xyzw (T,4),
30 fps, z up) and meshes/<object>.npz; a clip's name is subject_object_number. Lengths in cm. The person is
not given in any frame. Beside each figure stands that of not learning at all: palms on two opposite
sides of the object.
"""

import argparse
from pathlib import Path

import numpy as np
import torch
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from omomo_core.body.load import load_body
from omomo_core.generation.body import sample_body
from omomo_core.generation.generator import generate
from omomo_core.generation.result import GenerationOptions
from omomo_core.generation.scene import scene_of
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import HandMotion, ObjectMesh, ObjectMotion
from omomo_core.weights.load import load_stages

NAMES = (
    *("Pelvis", "L_Hip", "R_Hip", "Torso", "L_Knee", "R_Knee", "Spine", "L_Ankle", "R_Ankle"),
    *("Chest", "L_Toe", "R_Toe", "Neck", "L_Thorax", "R_Thorax", "Head", "L_Shoulder"),
    *("R_Shoulder", "L_Elbow", "R_Elbow", "L_Wrist", "R_Wrist"),
)
TOUCH = 0.05
"""The paper's evaluation counts a palm within 5 cm of a vertex as touching."""


def read(path: Path) -> tuple[ObjectMotion, np.ndarray]:
    """The object's motion and the person's 24 joints."""
    with np.load(path, allow_pickle=False) as clip:
        order = [list(clip["joint_names"]).index(name) for name in NAMES]
        joints = np.concatenate([clip["joints"][:, order], clip["palms"]], axis=1)
        T = np.tile(np.eye(4), (len(joints), 1, 1))
        T[:, :3, :3] = Rotation.from_quat(clip["obj_rot_xyzw"]).as_matrix()
        T[:, :3, 3] = clip["obj_pos"]
    name = path.stem.split("_")[1]
    with np.load(path.parent / "meshes" / f"{name}.npz", allow_pickle=False) as file:
        mesh = ObjectMesh(file["vertices"].astype(float), file["faces"].astype(np.int64), name)
    return ObjectMotion(mesh, T, np.ones(len(T), bool)), joints.astype(float)


def touching(palms: np.ndarray, motion: ObjectMotion) -> np.ndarray:
    """(frames, 2): the palm is within 5 cm of a vertex."""
    T = inverse(motion.T_world_object)
    local = np.einsum("fij,fhj->fhi", T[:, :3, :3], palms) + T[:, None, :3, 3]
    return KDTree(motion.mesh.vertices).query(local)[0] < TOUCH


def f1(found: np.ndarray, true: np.ndarray) -> float:
    """Frame-wise F1 of "some hand touches"."""
    a, b = found.any(axis=1), true.any(axis=1)
    return 2 * (a & b).sum() / max(1, a.sum() + b.sum())


def errors(joints: np.ndarray, true: np.ndarray) -> dict[str, float]:
    """HandJPE, MPJPE (pelvis-relative) and T_root, cm (the paper's section 5)."""

    def distance(a: np.ndarray, b: np.ndarray) -> float:
        return 100 * float(np.linalg.norm(a - b, axis=-1).mean())

    return {
        "hand": distance(joints[:, 22:], true[:, 22:]),
        "mpjpe": distance(joints - joints[:, :1], true - true[:, :1]),
        "root": distance(joints[:, 0], true[:, 0]),
    }


def skating(joints: np.ndarray) -> float:
    """Horizontal speed of toes within 3 cm of their lowest level, cm/s."""
    toes = joints[:, 10:12]
    low = toes[1:, :, 2] < np.percentile(toes[..., 2], 5) + 0.03
    speed = 3000 * np.linalg.norm(np.diff(toes[..., :2], axis=0), axis=-1)
    return float(speed[low].mean()) if low.any() else 0.0


def unlearned(motion: ObjectMotion) -> np.ndarray:
    """Palms on the two surface points farthest apart along the widest horizontal axis."""
    T, vertices = motion.T_world_object, motion.mesh.vertices
    flat = (vertices @ T[0, :3, :3].T)[:, :2]
    axis = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)[2][0]
    ends = vertices[[np.argmax(flat @ axis), np.argmin(flat @ axis)]]
    return ends @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]


def measure(path: Path, stages, body, samples: int) -> dict[str, float]:
    """Every figure of one clip."""
    motion, true = read(path)
    options = GenerationOptions(samples=samples)
    people = generate(motion, body, stages, options, lambda name, done: None)
    each = [errors(m.joints, true) for m in people.motions]
    best = each[int(np.argmin([e["mpjpe"] for e in each]))]
    one, chosen = each[people.chosen], people.motions[people.chosen]
    held = touching(true[:, 22:], motion)
    hands = [HandMotion(true[:, 22:], held.astype(float))] * samples
    given = [
        errors(h.joints, true)
        for h, _ in sample_body(
            scene_of(motion, body.height, stages.height),
            hands,
            body,
            stages.body,
            options,
            torch.Generator().manual_seed(0),
            lambda name, done: None,
        )
    ]
    good = given[int(np.argmin([e["mpjpe"] for e in given]))]
    guess = unlearned(motion)
    swapped = [
        100 * np.linalg.norm(g - true[:, 22:], axis=-1).mean() for g in (guess, guess[:, ::-1])
    ]
    return {
        "HandJPE K=1": one["hand"],
        f"HandJPE K={samples}": min(e["hand"] for e in each),
        "HandJPE unlearned K=1": float(np.mean(swapped)),
        "HandJPE unlearned K=2": float(min(swapped)),
        "contact F1": f1(touching(chosen.joints[:, 22:], motion), held),
        "MPJPE K=1": one["mpjpe"],
        f"MPJPE K={samples}": best["mpjpe"],
        "T_root K=1": one["root"],
        f"T_root K={samples}": best["root"],
        "MPJPE K=1, true palms": float(np.mean([e["mpjpe"] for e in given])),
        f"MPJPE K={samples}, true palms": good["mpjpe"],
        "T_root K=1, true palms": float(np.mean([e["root"] for e in given])),
        f"T_root K={samples}, true palms": good["root"],
        "skating": skating(chosen.joints),
        "skating of the real person": skating(true),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clips", type=Path)
    parser.add_argument("--weights", type=Path)
    parser.add_argument("--samples", type=int, default=20)
    given = parser.parse_args()
    stages, body = load_stages("capture", given.weights), load_body()
    paths = sorted(given.clips.glob("*.npz"))
    rows = [measure(p, stages, body, given.samples) for p in track(paths)]
    table = Table("mean over clips", "cm (F1: share)")
    for key in rows[0]:
        table.add_row(key, f"{np.mean([r[key] for r in rows]):.2f}")
    Console().print(table)


if __name__ == "__main__":
    main()
