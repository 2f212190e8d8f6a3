"""Wrist targets: hands are turned so that their palms face the surface that they hold."""

from collections.abc import Sequence

import numpy as np
import roma
import torch
from jaxtyping import Float
from scipy.interpolate import interp1d
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.config import JOINT_RANGES
from omomo_core.body.trajectory_optimization.targets import InteractionTargets
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.collision.root import ELBOWS
from omomo_core.generation.solving.config import WRIST
from omomo_core.generation.solving.reach import solve_arms
from omomo_core.geometry.surface import Surface

_RANGES = torch.tensor([JOINT_RANGES.left_wrist, JOINT_RANGES.right_wrist])
"""Of the left and the right wrist: least and greatest component about each axis, radians."""


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


def lay_palms(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    targets: InteractionTargets,
) -> Float[Tensor, "samples frames 22 3 3"]:
    """Return rotations whose holding palms lie on the surface, the arms solved again; palms stay in place.

    Avoidance and optimisation leave palms tilted: their fingers point into what they hold. Each palm is
    turned to the surface and then about its normal, as far as the wrist's range wants.

    Args:
        body: whose arms.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint, palms on their targets.
        targets: what hands hold.
    """
    R_world_object = torch.from_numpy(targets.T_world_object[:, None, :3, :3]).to(rotations)
    shift = torch.from_numpy(targets.T_world_object[:, None, :3, 3]).to(rotations)
    local = (R_world_object.mT @ (targets.palms.to(rotations) - shift)[..., None])[..., 0]
    out = (R_world_object @ targets.obstacle.field.away(local)[..., None])[..., 0]
    # A hand that comes lies already as it will: half a hold is enough.
    hold = (2 * targets.hold.to(rotations)).clamp(max=1.0)[..., None]
    before, count = rotations[:, :, WRISTS], rotations.shape[1]
    seen = torch.arange(0, count + WRIST.stride - 1, WRIST.stride).clamp(max=count - 1).unique()
    for _ in range(WRIST.rounds):
        laid = _laid(
            rotations[:, seen][:, :, ELBOWS], rotations[:, seen][:, :, WRISTS], out[:, seen]
        )
        turn = roma.rotmat_to_rotvec(laid @ before[:, seen].mT) * hold[:, seen]
        every = turn.numpy()
        if count > 1:
            every = interp1d(seen.numpy(), every, axis=1, assume_sorted=True)(np.arange(count))
        smooth = gaussian_filter1d(every, WRIST.smoothing, axis=1, mode="nearest")
        turned = roma.rotvec_to_rotmat(torch.from_numpy(smooth).to(rotations) * hold) @ before
        rotations = rotations.clone()
        rotations[:, :, WRISTS] = turned
        rotations = solve_arms(body, root, rotations, targets)
    return rotations


def _laid(
    R_world_forearm: Float[Tensor, "*b 2 3 3"],
    R_world_wrist: Float[Tensor, "*b 2 3 3"],
    out: Float[Tensor, "*b 2 3"],
) -> Float[Tensor, "*b 2 3 3"]:
    """Return wrists turned to the surface and about its normal, at the least cost of range and tilt."""
    axis = torch.linalg.cross(-R_world_wrist[..., 1], -out)
    angle = torch.atan2(axis.norm(dim=-1), (R_world_wrist[..., 1] * out).sum(dim=-1))
    axis = torch.nn.functional.normalize(axis, dim=-1)
    headings = torch.linspace(-WRIST.heading, WRIST.heading, WRIST.headings)
    heading, kept = torch.cartesian_prod(headings, torch.tensor(WRIST.kept_tilts)).T

    def turned(heading: Tensor, kept: Tensor) -> Tensor:
        tilt = roma.rotvec_to_rotmat(
            axis[..., None, :] * (angle[..., None] * (1 - kept))[..., None]
        )
        about = roma.rotvec_to_rotmat(out[..., None, :] * heading[..., None])
        return about @ tilt @ R_world_wrist[..., None, :, :]

    bend = roma.rotmat_to_rotvec(R_world_forearm[..., None, :, :].mT @ turned(heading, kept))
    low, high = _RANGES[:, None, :, 0] + WRIST.spare, _RANGES[:, None, :, 1] - WRIST.spare
    excess = (bend - high).clamp(min=0) + (low - bend).clamp(min=0)
    cost = (
        excess.sum(dim=-1)
        + WRIST.heading_cost * heading.square()
        + WRIST.tilt_cost * (angle[..., None] * kept).square()
    )
    # The mean of the cheapest: between two that cost the same a hand does not jump.
    share = torch.softmax(-cost / WRIST.softness, dim=-1)
    return turned(*((share * x).sum(dim=-1, keepdim=True) for x in (heading, kept)))[..., 0, :, :]
