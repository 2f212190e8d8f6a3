"""Motion files for tests: one stepping person, written as other programs would."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import global_rotations, sole_points
from omomo_core.body.model import load_body
from omomo_core.skeleton import BODY_JOINTS, MODEL_PARENTS, joint

BODY = load_body()
R_YUP_ZUP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
UPRIGHT = R_YUP_ZUP.T


_RIG = {"pelvis": "Hips", "head": "Head", "neck": "Neck"} | {
    f"{side}_{ours}": f"{side.title()}{theirs}"
    for side in ("left", "right")
    for ours, theirs in {
        "hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "foot": "ToeBase", "collar": "Shoulder",
        "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand",
    }.items()
}  # fmt: skip


def rig_name(joint: str) -> str:
    """The name that a rig without a prefix gives to a joint of ours."""
    return _RIG.get(joint, joint)


def stepping(frames: int = 120) -> tuple[np.ndarray, np.ndarray]:
    """Root and local rotations (axis-angle, SMPL's order) of a walk along -y with swinging arms."""
    t = np.linspace(0, 8 * np.pi, frames)
    pose = np.zeros((frames, 22, 3))
    pose[:, 0] = Rotation.from_matrix(UPRIGHT).as_rotvec()
    for sign, side in ((1, "left"), (-1, "right")):
        pose[:, joint(f"{side}_hip"), 0] = -0.35 * sign * np.sin(t)
        pose[:, joint(f"{side}_knee"), 0] = 0.15 + 0.5 * np.clip(sign * np.cos(t), 0, None)
        down = Rotation.from_euler("z", -sign * 1.2)
        swing = Rotation.from_euler("x", 0.3 * sign * np.sin(t)[:, None])
        pose[:, joint(f"{side}_shoulder")] = (swing * down).as_rotvec()
        pose[:, joint(f"{side}_elbow"), 1] = -sign * (0.5 + 0.2 * np.sin(t))
    R = _matrices(pose)
    # The lower foot stands: the pelvis goes where it must.
    feet = sole_points(BODY, np.zeros((frames, 3)), R)
    low = feet[..., 2].argmin(1)
    rows = np.arange(frames)
    step = np.zeros((frames, 3))
    step[1:] = -(feet[rows[1:], low[1:]] - feet[rows[:-1], low[1:]])
    root = step.cumsum(0)
    root[:, 2] = -feet[rows, low, 2]
    return root, pose


def write_bvh(
    path: Path,
    name: Callable[[str], str | None],
    *,
    unit: float = 100.0,
    arms: float = 0.0,
    scale: float = 1.0,
    up: str = "y",
) -> Float[np.ndarray, "frames 22 3 3"]:
    """The walk as BVH, with joints named by `name` and arms lowered by `arms` radians at rest.

    Returns the global rotations, in our terms, that should be found again.
    """
    root, pose = stepping()
    R = _matrices(pose)
    lowered = _lowered(arms)
    turn = R_YUP_ZUP if up == "y" else np.eye(3)
    # In a file with z up the rest pose stands along z too.
    base = np.eye(3) if up == "y" else UPRIGHT
    Q = np.stack([turn @ R[:, j] @ lowered[j].T @ base.T for j in range(22)], 1)
    rest, lines, order = BODY.rest_joints.double().numpy(), ["HIERARCHY"], list[int]()

    def put(j: int, depth: int) -> None:
        above, children = max(MODEL_PARENTS[j], 0), [c for c in range(22) if MODEL_PARENTS[c] == j]
        offset = base @ lowered[above] @ (rest[j] - rest[above]) * unit * scale
        lines.extend(_joint_lines(name(BODY_JOINTS[j]), offset, depth))
        order.append(j)
        for child in children:
            put(child, depth + 1)
        if not children:
            lines.extend(_tip_lines(base @ lowered[j] @ np.array([0, 0, 0.06]) * unit, depth))
        lines.append("  " * depth + "}")

    put(0, 0)
    columns = [root @ turn.T * unit * scale]
    for j in order:
        local = Q[:, j] if j == 0 else np.swapaxes(Q[:, MODEL_PARENTS[j]], -1, -2) @ Q[:, j]
        columns.append(Rotation.from_matrix(local).as_euler("ZXY", degrees=True))
    values = np.concatenate(columns, axis=1)
    lines += ["MOTION", f"Frames: {len(values)}", f"Frame Time: {1 / 30:.8f}"]
    lines += [" ".join(f"{v:.6f}" for v in row) for row in values]
    path.write_text("\n".join(lines) + "\n")
    return R


def _matrices(pose: Float[np.ndarray, "frames 22 3"]) -> Float[np.ndarray, "frames 22 3 3"]:
    """Global rotations of local axis-angles."""
    local = Rotation.from_rotvec(pose.reshape(-1, 3)).as_matrix().reshape(-1, 22, 3, 3)
    return global_rotations(torch.from_numpy(local)).numpy()


def _lowered(arms: float) -> list[np.ndarray]:
    """How a rest pose differs from ours, joint by joint: the arms hang by so many radians."""
    lowered = [np.eye(3)] * 22
    for sign, side in ((-1, "left"), (1, "right")):
        for part in ("shoulder", "elbow", "wrist"):
            lowered[joint(f"{side}_{part}")] = Rotation.from_euler("z", sign * arms).as_matrix()
    return lowered


def _joint_lines(label: str | None, offset: Float[np.ndarray, " 3"], depth: int) -> list[str]:
    pad = "  " * depth
    channels = "CHANNELS 3" if depth else "CHANNELS 6 Xposition Yposition Zposition"
    return [
        f"{pad}{'JOINT' if depth else 'ROOT'} {label}",
        pad + "{",
        f"{pad} OFFSET {offset[0]:.6f} {offset[1]:.6f} {offset[2]:.6f}",
        f"{pad} {channels} Zrotation Xrotation Yrotation",
    ]


def _tip_lines(tip: Float[np.ndarray, " 3"], depth: int) -> list[str]:
    pad = "  " * depth
    offset = f"{pad}  OFFSET {tip[0]} {tip[1]} {tip[2]}"
    return [f"{pad} End Site", f"{pad} {{", offset, f"{pad} }}"]
