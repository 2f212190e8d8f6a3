"""The person of a recorded clip on our terms: their skeleton as a body, their pose in our rotations.

A clip's rest pose has other axes (x forward, y left, z up) than ours, arms and legs that point elsewhere and
raised shoulders (`body.rest_turns`). With both taken out a rotation means to this skeleton what it means to
ours, and forward kinematics gives the clip's joints back. People who were recorded in shoes stand on their
soles.
"""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float

from omomo_core.body.kinematics import MODEL_REST
from omomo_core.body.model import BodyModel, with_height
from omomo_core.body.rest_turns import Offsets, rest_turns
from omomo_core.body.soles import TOES
from omomo_core.learning.evaluation.metrics import floor_height
from omomo_core.skeleton import MODEL_ABOVE, MODEL_PARENTS, PALM_JOINTS, joint

AXES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""R_clip_ours at rest: our left, up and forward are the clip's y, z and x."""
THINNEST_SOLE, THICKEST_SOLE = -0.02, 0.06
"""Metres: what is beyond is a floor that was found wrongly, not shoes."""


def bone_offsets(
    joints: Float[np.ndarray, "frames 24 3"], rotations: Float[np.ndarray, "frames 22 3 3"]
) -> tuple[Offsets, float]:
    """Where each joint sits in its parent's frame (median over the frames), and the farthest that
    any frame strays from it, metres, in the clip's axes: bones do not change their length.
    """
    parents = np.array(MODEL_PARENTS[1:])
    local = np.einsum(
        "fjyx,fjy->fjx", rotations[:, parents], joints[:, 1:] - joints[:, parents], optimize=True
    )
    offsets = np.zeros((24, 3))
    offsets[1:] = np.median(local, axis=0)
    return offsets, float(np.linalg.norm(local - offsets[1:], axis=-1).max())


def our_rotations(
    rotations: Float[np.ndarray, "frames 22 3 3"], offsets: Offsets, body: BodyModel
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Rotations of a clip with the identity at our T-pose."""
    return rotations @ AXES @ rest_turns(body, offsets @ AXES)


def body_of(
    offsets: Offsets, body: BodyModel, joints: Float[np.ndarray, "frames 24 3"]
) -> BodyModel:
    """Return our body with the bones and shoes of a clip's person; its surface follows the joints.

    Args:
        offsets: of the person's bones, in the clip's axes.
        body: whose surface the person gets.
        joints: of the clip, world, metres. They show how high toes stand above the floor.
    """
    theirs = offsets @ AXES
    bones = np.einsum("jyx,jy->jx", rest_turns(body, theirs)[list(MODEL_ABOVE)], theirs)
    rest = np.zeros((24, 3))
    for j in range(1, 24):
        rest[j] = rest[MODEL_PARENTS[j]] + bones[j]
    ours = body.rest_joints.double().numpy()
    scaled = with_height(body, body.height * _best_scale(rest, ours[list(MODEL_REST)]))
    bare = _all_joints(rest, scaled.rest_joints.double().numpy())
    floor = float(scaled.vertices[:, 1].min())
    sole = _shoe_sole(float(bare[list(TOES), 1].mean()) - floor, floor_height(joints))
    moved = torch.from_numpy(bare + np.array([0.0, sole, 0.0])).float()
    return replace(
        scaled,
        name=f"{body.name} with a recorded person's bones",
        rest_joints=moved,
        vertices=scaled.vertices + _follow(scaled, moved - scaled.rest_joints),
        shoe_sole=sole,
    )


def _shoe_sole(bare: float, standing: float) -> float:
    """Return how thick soles are, metres, from how high toe joints are on bare feet and as recorded.

    Args:
        bare: height of toe joints above the floor, metres.
        standing: the same of the recorded ones that stand; 0 if none do, and bare feet are taken.
    """
    return float(np.clip(standing - bare, THINNEST_SOLE, THICKEST_SOLE)) if standing else 0.0


def _best_scale(theirs: Float[np.ndarray, "24 3"], ours: Float[np.ndarray, "24 3"]) -> float:
    """Least squares over the joints of the T-pose, measured from between the ankles."""
    a, b = (x - x[[7, 8]].mean(axis=0) for x in (ours, theirs))
    return float((a * b).sum() / (a * a).sum())


def _all_joints(
    rest: Float[np.ndarray, "24 3"], ours: Float[np.ndarray, "52 3"]
) -> Float[np.ndarray, "52 3"]:
    """Fingers keep our hand's shape about the person's palm; the ankles are as high as ours."""
    up = np.array([0.0, ours[[7, 8], 1].mean() - rest[[7, 8], 1].mean(), 0.0])
    shifts = [rest[22 + side] - ours[palm] for side, palm in enumerate(PALM_JOINTS)]
    return np.concatenate([rest[:22], ours[22:37] + shifts[0], ours[37:] + shifts[1]]) + up


def _follow(body: BodyModel, moves: Float[torch.Tensor, "52 3"]) -> Float[torch.Tensor, "verts 3"]:
    """Return how the surface moves with the joints.

    The head follows the neck, so that its size stays. What is on the floor stays on it: feet are stretched
    below their toe joints.
    """
    moves = moves.clone()
    moves[joint("head")] = moves[joint("neck")]
    moved = (body.skin_weights[..., None] * moves[body.skin_joints]).sum(dim=1)
    height = body.vertices[:, 1] - body.vertices[:, 1].min()
    toes = body.rest_joints[list(TOES), 1].mean() - body.vertices[:, 1].min()
    moved[:, 1] *= (height / toes).clamp(max=1.0)
    return moved
