"""Pelvis tilt: people bend in the small of the back, so the pelvis takes only a part of the chest's pitch.

The synthetic people that stage 2 was trained on hinge more at the hips, and sampled ones do so too.
"""

import roma
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.model import BodyModel
from omomo_core.generation.config import BODY_DECODING
from omomo_core.skeleton import joint

_CHEST = joint("spine3")


def tilt_pelvis(
    body: BodyModel, root: Float[Tensor, "*b 3"], rotations: Float[Tensor, "*b 22 3 3"]
) -> tuple[Float[Tensor, "*b 3"], Float[Tensor, "*b 22 3 3"]]:
    """Return root and rotations with the pelvis turned about the line through the hips, which stay in place.

    Args:
        body: whose bones.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
    """
    pelvis = rotations[..., 0, :, :]
    change = BODY_DECODING.pelvis_tilt * pitch(rotations, _CHEST) - pitch(rotations, 0)
    turned = roma.rotvec_to_rotmat(pelvis[..., 0] * change[..., None]) @ pelvis
    out = rotations.clone()
    out[..., 0, :, :] = turned
    return root + (pelvis - turned) @ body.hips.to(root), out


def pitch(rotations: Float[Tensor, "*b 22 3 3"], of: int) -> Float[Tensor, "*b"]:
    """Return how far a joint is pitched forward in the direction the pelvis faces, radians."""
    left, up = rotations[..., 0, :, 0], rotations[..., of, :, 1]
    ahead = torch.stack([left[..., 1], -left[..., 0]], dim=-1)
    ahead = ahead / ahead.norm(dim=-1, keepdim=True).clamp(min=1e-6)
    return torch.atan2((up[..., :2] * ahead).sum(dim=-1), up[..., 2])
