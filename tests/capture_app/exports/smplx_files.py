"""Stand-ins for the licensed SMPL-X file, and its forward kinematics."""

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS, joint


def raise_shoulders(rest: np.ndarray) -> None:
    """As SMPL-X's T-pose does."""
    trunk_and_legs = ("collar", "hip", "knee", "ankle", "foot")
    for side in ("left", "right"):
        sided = [name for name in ALL_JOINTS if name.startswith(side)]
        arm = [joint(name) for name in sided if not name.endswith(trunk_and_legs)]
        collar = rest[joint(f"{side}_shoulder")] - rest[joint(f"{side}_collar")]
        rest[arm] -= 2 * collar * [0, 1, 0]


def write_smplx(path: Path, rest: np.ndarray) -> None:
    kept = [*range(22), *range(25, 55)]
    joints = np.zeros((55, 3))
    joints[kept] = rest
    regressor = np.zeros((55, 56))
    regressor[:, :55] = np.eye(55)
    weights = np.zeros((56, 55))
    weights[:55] = np.eye(55)
    weights[55, 0] = 1.0
    low = np.array([[0.0, rest[:, 1].min() - 0.03, 0.0]])
    np.savez(
        path,
        v_template=np.concatenate([joints, low]),
        f=np.array([[0, 1, 2]]),
        J_regressor=regressor,
        weights=weights,
        kintree_table=np.zeros((2, 55), int),
    )


def posed(pose: np.ndarray, trans: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """SMPL-X's own forward kinematics: the template's pelvis is where trans is zero."""
    R = Rotation.from_rotvec(pose.reshape(-1, 3)).as_matrix().reshape(*pose.shape, 3)
    out = np.zeros(pose.shape)
    out[:, 0] = rest[0] + trans
    for j in range(1, 52):
        p = ALL_PARENTS[j]
        out[:, j] = out[:, p] + R[:, p] @ (rest[j] - rest[p])
        R[:, j] = R[:, p] @ R[:, j]
    return out
