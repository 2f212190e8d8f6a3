"""Forward kinematics. Rotations are global and identity at rest, so every body shares them.

A joint sits at its parent plus the parent's global rotation of the rest offset. The whole tree is
one matrix product: the 0/1 matrix of ancestors sums the rotated bones from the root to each joint.
"""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.model import BodyModel
from omomo_core.skeleton import ALL_PARENTS, BODY_PARENTS, MODEL_PARENTS, PALM_JOINTS, joint

WRISTS = (joint("left_wrist"), joint("right_wrist"))
MODEL_REST = (*range(22), *PALM_JOINTS)
"""Where the 24 joints of the model stand among a body's 52."""


def _ancestors(parents: Sequence[int]) -> Float[Tensor, "joints joints"]:
    """Return a matrix with 1 where column k is joint j or one of its ancestors, the root excluded."""
    matrix = torch.zeros(len(parents), len(parents))
    for j, parent in enumerate(parents):
        if parent >= 0:
            matrix[j] = matrix[parent]
            matrix[j, j] = 1.0
    return matrix


_MODEL_ANCESTORS = _ancestors(MODEL_PARENTS)
_ALL_ANCESTORS = _ancestors(ALL_PARENTS)


def forward_kinematics(
    body: BodyModel, root: Float[Tensor, "*b 3"], rotations: Float[Tensor, "*b 22 3 3"]
) -> Float[Tensor, "*b 24 3"]:
    """Return the joints of the model: the 22 body joints, then the left and right palm.

    Args:
        body: whose bone lengths to use.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint of the body joints.

    Returns:
        Joint positions, world, metres; the palms turn with their wrists.
    """
    rest = body.rest_joints[list(MODEL_REST)]
    return _place(root, rotations, rest, MODEL_PARENTS, _MODEL_ANCESTORS)


def joints_of(
    body: BodyModel,
    root: Float[np.ndarray, "*b 3"],
    rotations: Float[np.ndarray, "*b 22 3 3"],
) -> Float[np.ndarray, "*b 24 3"]:
    """Return what `forward_kinematics` does, for numpy arrays."""
    return forward_kinematics(
        body, torch.as_tensor(root, dtype=torch.float64), torch.as_tensor(rotations)
    ).numpy()


def full_kinematics(
    body: BodyModel,
    root: Float[Tensor, "*b 3"],
    rotations: Float[Tensor, "*b 22 3 3"],
    fingers: Float[Tensor, "*b 30 3 3"],
) -> tuple[Float[Tensor, "*b 52 3"], Float[Tensor, "*b 52 3 3"]]:
    """Return every joint of the body, fingers included.

    Args:
        body: whose bone lengths to use.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint of the body joints.
        fingers: rotation of each finger joint relative to its parent.

    Returns:
        Joint positions (world, metres) and global rotations in the order of ALL_JOINTS.
    """
    R_global = torch.cat([rotations, _finger_rotations(rotations, fingers)], dim=-3)
    return _place(root, R_global, body.rest_joints, ALL_PARENTS, _ALL_ANCESTORS), R_global


def global_rotations(local: Float[Tensor, "*b 22 3 3"]) -> Float[Tensor, "*b 22 3 3"]:
    """R_world_joint of the body joints from rotations relative to the parents (pelvis: to the world)."""
    turned = [local[..., 0, :, :]]
    for j in range(1, len(BODY_PARENTS)):
        turned.append(turned[BODY_PARENTS[j]] @ local[..., j, :, :])
    return torch.stack(turned, dim=-3)


def _place(
    root: Float[Tensor, "*b 3"],
    rotations: Float[Tensor, "*b turning 3 3"],
    rest: Float[Tensor, "joints 3"],
    parents: Sequence[int],
    ancestors: Float[Tensor, "joints joints"],
) -> Float[Tensor, "*b joints 3"]:
    """Rotate each bone of the rest pose by its parent and sum the bones along the tree."""
    above = [max(parent, 0) for parent in parents]
    offsets = (rest - rest[above]).to(rotations)
    bones = torch.einsum("...jxy,jy->...jx", rotations[..., above, :, :], offsets)
    return root[..., None, :] + ancestors.to(rotations) @ bones


def _finger_rotations(
    rotations: Float[Tensor, "*b 22 3 3"], fingers: Float[Tensor, "*b 30 3 3"]
) -> Float[Tensor, "*b 30 3 3"]:
    """Global rotations of the finger joints: three links after the wrist, ten fingers at once."""
    links = fingers.unflatten(-3, (2, 5, 3))
    above = rotations[..., list(WRISTS), None, :, :]
    turned: list[Tensor] = []
    for k in range(3):
        above = above @ links[..., k, :, :]
        turned.append(above)
    return torch.stack(turned, dim=-3).flatten(-5, -3)
