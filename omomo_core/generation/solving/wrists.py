"""Wrist targets: hands are turned so that their palms face the surface that they hold."""

from collections.abc import Sequence

import numpy as np
import roma
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.solving.config import WRIST
from omomo_core.geometry.surface import Surface


def face_palms(
    R_world_wrist: Float[Tensor, "frames 2 3 3"],
    segments: Sequence[ContactSegment],
    surface: Surface,
    T_world_object: Float[np.ndarray, "frames 4 4"],
) -> Float[Tensor, "frames 2 3 3"]:
    """Return R_world_wrist turned by as little as brings each palm to face the surface at its anchor.

    Args:
        R_world_wrist: of the sample; the palm looks along -y at rest.
        segments: what each hand holds and when.
        surface: of the object, its frame.
        T_world_object: its pose per frame.
    """
    turned = R_world_wrist.clone()
    R_world_object = torch.from_numpy(T_world_object[:, :3, :3]).to(turned)
    for s in segments:
        _, nearest = surface.tree.query(s.anchor)
        out = s.anchor - surface.points[nearest]
        out = out / max(float(np.linalg.norm(out)), 1e-6)
        frames = slice(s.start, s.stop)
        R = R_world_wrist[frames, s.hand]
        into = -(R_world_object[frames] @ torch.from_numpy(out).to(R))
        turn = _toward(-R[..., 1], into, WRIST.tolerance, WRIST.farthest)
        turned[frames, s.hand] = turn @ R
    return turned


def _toward(
    now: Float[Tensor, "*b 3"], goal: Float[Tensor, "*b 3"], tolerance: float, farthest: float
) -> Float[Tensor, "*b 3 3"]:
    """Return the rotation that brings `now` within `tolerance` of `goal`, by `farthest` at most."""
    axis = torch.linalg.cross(now, goal)
    angle = torch.atan2(axis.norm(dim=-1), (now * goal).sum(dim=-1))
    turn = (angle - tolerance).clamp(0.0, farthest)
    unit = torch.nn.functional.normalize(axis, dim=-1)
    return roma.rotvec_to_rotmat(unit * turn[..., None])
