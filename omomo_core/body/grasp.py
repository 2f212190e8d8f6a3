"""Grasp: fingers that lie on what a hand holds, with every joint free within its range.

Each contact has one grip (`grip.py`). From it the fingers of all key frames are fitted together by
Gauss-Newton: no skin in the object, pads on its surface, close to the grip, smooth in time. Fingers take the
grip's shape before the hand arrives and relax after it has let go.
"""

from dataclasses import dataclass

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float, Int
from scipy.linalg import solveh_banded
from torch import Tensor

from omomo_core.body.config import GRASP, GRIP
from omomo_core.body.finger_model import ANGLES, FingerModel, finger_model, pose_fingers, rotations
from omomo_core.body.grip import HandPoses, find_grips, relaxed_angles
from omomo_core.body.model import BodyModel
from omomo_core.geometry.distance_field import DistanceField
from omomo_core.geometry.easing import min_jerk
from omomo_core.geometry.runs import runs

_FULL = 0.99
"""Weight of a hand from which on it is in contact."""
_MILLIMETRES = 1000.0


@dataclass(frozen=True)
class ClosedFingers:
    """Finger rotations of both hands, and how deep fingers are inside the object."""

    fingers: Float[Tensor, "*b frames 30 3 3"]
    """Rotation of each finger joint relative to its parent."""
    depth: Float[Tensor, "*b frames 2"]
    """Depth of the deepest finger of the left and the right hand, metres; 0 where none is inside."""


@dataclass(frozen=True)
class _KeyFrames:
    """Key frames of sequences of one hand each, flattened: those in which fingers leave their rest."""

    poses: HandPoses
    place: Int[Tensor, "keys 2"]
    """Sequence and number of the key frame in it."""
    hold: Float[Tensor, " keys"]
    """How much the hand holds."""
    goal: Float[Tensor, "keys 5 angles"]
    """The grip, blended with the relaxed hand."""


def close_fingers(
    body: BodyModel,
    R_world_wrist: Float[Tensor, "*b frames 2 3 3"],
    wrists: Float[Tensor, "*b frames 2 3"],
    T_world_object: Float[Tensor, "frames 4 4"],
    field: DistanceField,
    weight: Float[Tensor, "*b frames 2"],
) -> ClosedFingers:
    """Return the fingers of both hands closed on an object.

    Args:
        body: whose hands; where they are free its fingers are relaxed.
        R_world_wrist: global rotation of the left and the right wrist.
        wrists: wrist joints, world, metres.
        T_world_object: the object's pose.
        field: signed distance to the object, in its frame.
        weight: how much each hand holds the object, 0 free to 1.
    """
    model, frames = finger_model(body), weight.shape[-2]
    R_object_world = T_world_object[:, None, :3, :3].mT.float()
    R = R_object_world @ R_world_wrist.float()
    shift = (wrists - T_world_object[:, None, :3, 3]).float()
    at = (R_object_world @ shift[..., None])[..., 0]
    # Sequences of one hand: samples by sides.
    R, at = (x.flatten(0, -x.dim() + weight.dim() - 3) if weight.dim() > 2 else x[None] for x in (R, at))
    held = weight.float().reshape(-1, frames, 2).transpose(1, 2).reshape(-1, frames)
    R, at = R.transpose(1, 2).flatten(0, 1), at.transpose(1, 2).flatten(0, 1)
    side = torch.arange(2).repeat(len(held) // 2)
    relaxed = body.relaxed_fingers.view(2, 5, 3, 3, 3)[side][:, None].expand(-1, frames, -1, -1, -1, -1)
    fingers, depth = relaxed.clone(), torch.zeros(len(held), frames)
    away = held if not held.numel() else torch.from_numpy(np.stack([_away(w) for w in held.numpy()]))
    keys = torch.arange(0, frames, GRASP.stride)
    share = _falling(away, GRASP.shaping, GRASP.leaving)
    if frames and (share > 0).any():
        if keys[-1] != frames - 1:
            keys = torch.cat([keys, torch.tensor([frames - 1])])
        chosen = _key_frames(body, R, at, side, held, away, keys, field)
        angles = _fitted(model, chosen, (len(held), len(keys)), field)
        row, frame = (share > 0).nonzero().T
        between = _interpolated(angles, keys, row, frame)
        found = rotations(model, side[row], between)
        free = relaxed[row, frame]
        turn = share[row, frame][:, None, None, None] * roma.rotmat_to_rotvec(free.mT @ found)
        fingers[row, frame] = free @ roma.rotvec_to_rotmat(turn)
        poses = HandPoses(R[row, frame], at[row, frame], side[row])
        skin = poses.placed(pose_fingers(model, poses.side, between).points)
        depth[row, frame] = (-field.at(skin).flatten(1).amin(dim=1)).clamp(min=0.0)
    shape = weight.shape
    fingers = fingers.unflatten(0, (-1, 2)).transpose(1, 2).reshape(*shape[:-1], 30, 3, 3)
    return ClosedFingers(fingers, depth.unflatten(0, (-1, 2)).mT.reshape(shape))


def _away(weight: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    """Return the frames from each frame to the nearest contact; infinite where there is none."""
    frames, away = np.arange(len(weight)), np.full(len(weight), np.inf, np.float32)
    for start, stop in runs(weight >= min(_FULL, max(float(weight.max()), 1e-3))):
        away = np.minimum(away, np.maximum(np.maximum(start - frames, frames - stop + 1), 0))
    return away


def _falling(away: Float[Tensor, "*n"], first: float, last: float) -> Float[Tensor, "*n"]:
    """Return 1 up to `first` frames away from a contact, falling smoothly to 0 at `last`."""
    return torch.from_numpy(min_jerk(((last - away) / (last - first)).numpy())).float()


def _key_frames(
    body: BodyModel,
    R: Float[Tensor, "rows frames 3 3"],
    at: Float[Tensor, "rows frames 3"],
    side: Int[Tensor, " rows"],
    held: Float[Tensor, "rows frames"],
    away: Float[Tensor, "rows frames"],
    keys: Int[Tensor, " keys"],
    field: DistanceField,
) -> _KeyFrames:
    """Return the key frames in which fingers leave their rest, with the grip of the nearest contact."""
    spans = [(row, *span) for row in range(len(held)) for span in runs((away[row] == 0).numpy())]
    share = (torch.arange(GRIP.poses) + 0.5) / GRIP.poses
    rows = torch.tensor([row for row, *_ in spans])
    start, stop = (torch.tensor([s[k] for s in spans]) for k in (1, 2))
    seen = (start[:, None] + share * (stop - start)[:, None]).long().flatten()
    from_rows = rows.repeat_interleave(GRIP.poses)
    grips = find_grips(
        body, HandPoses(R[from_rows, seen], at[from_rows, seen], side[from_rows]), field
    )
    row, key = (away[:, keys] < GRASP.leaving + GRASP.stride).nonzero().T
    frame = keys[key]
    apart = torch.maximum(start - frame[:, None], frame[:, None] - stop + 1).clamp(min=0).float()
    nearest = apart.masked_fill(rows != row[:, None], torch.inf).argmin(dim=1)
    shape = _falling(away[row, frame], 0.0, GRASP.shaping)[:, None, None]
    relaxed = relaxed_angles(body)
    return _KeyFrames(
        HandPoses(R[row, frame], at[row, frame], side[row]),
        torch.stack([row, key], dim=1),
        held[row, frame],
        relaxed + shape * (grips[nearest] - relaxed),
    )


def _fitted(
    model: FingerModel, keys: _KeyFrames, size: tuple[int, int], field: DistanceField
) -> Float[Tensor, "rows keys 5 angles"]:
    """Return the angles of all key frames that fit the object best (Gauss-Newton)."""
    row, key = keys.place.T
    angles = relaxed_angles(None).expand(*size, 5, ANGLES).clone()
    angles[row, key] = keys.goal
    for round_ in range(GRASP.rounds):
        H, g = _contact_equations(model, keys, angles[row, key], field, exact=round_ >= GRASP.rounds - GRASP.exact_rounds)
        H, g = _within_ranges(model, angles[row, key], H, g)
        step = _solved(H, g, keys.place, angles)
        angles = angles + step.clamp(-GRASP.longest_step, GRASP.longest_step)
        angles = torch.minimum(torch.maximum(angles, model.low), model.high)
    return angles


def _contact_equations(
    model: FingerModel,
    keys: _KeyFrames,
    angles: Float[Tensor, "keys 5 angles"],
    field: DistanceField,
    *,
    exact: bool,
) -> tuple[Float[Tensor, "keys 5 angles angles"], Float[Tensor, "keys 5 angles"]]:
    """Return the normal equations of each finger: depth, touch, and the posture of the grip."""
    posed = pose_fingers(model, keys.poses.side, angles)
    points = keys.poses.placed(posed.points)
    distance = field.at(points)
    near = distance < GRASP.touch_range
    out = torch.zeros_like(points)
    if exact:
        close = distance.abs() < GRASP.exact_range
        distance[close], out[close] = field.exact(points[close])
        rest = near & ~close
        out[rest] = field.away(points[rest])
    else:
        out[near] = field.away(points[near])
    slopes = posed.slopes((out.flatten(1, 2) @ keys.poses.R_object_wrist).view(out.shape))
    weight, residual = _contact_residuals(model, keys, distance)
    J = _MILLIMETRES * slopes
    H = torch.einsum("kfpa,kfp,kfpb->kfab", J, weight, J)
    g = -torch.einsum("kfpa,kfp->kfa", J, weight * residual)
    stiff = torch.tensor(GRASP.stiffness)
    H = H + torch.diag(stiff)
    g = g + stiff * (keys.goal - angles)
    # The last joint bends with the middle one.
    tie = torch.zeros(ANGLES)
    tie[3], tie[4] = -GRIP.last_joint, 1.0
    fingers = torch.tensor([1.0] * 4 + [0.0])[:, None]
    H = H + GRASP.synergy * torch.outer(tie, tie) * fingers[..., None]
    g = g - GRASP.synergy * (angles @ tie)[..., None] * tie * fingers
    return H, g


def _contact_residuals(
    model: FingerModel, keys: _KeyFrames, distance: Float[Tensor, "keys 5 points"]
) -> tuple[Float[Tensor, "keys 5 points"], Float[Tensor, "keys 5 points"]]:
    """Return weights and residuals (millimetres) of the skin's points: out of the object, on its surface."""
    side = keys.poses.side
    inside = distance < GRASP.margin
    palmar = model.palmar[side]
    gap = distance.masked_fill(~palmar, torch.inf).unflatten(-1, (3, -1))
    nearest = torch.softmax(-gap / GRASP.pad_softness, dim=-1)
    wanted = torch.tensor(GRASP.touching)[:, None] * nearest
    reach = torch.exp(-(distance.clamp(min=0.0) / GRASP.touch_range).square())
    touch = keys.hold[:, None, None] * wanted.flatten(-2) * reach
    weight = torch.where(inside, 1.0, touch)
    return weight, _MILLIMETRES * (distance - GRASP.margin)


def _within_ranges(
    model: FingerModel,
    angles: Float[Tensor, "some 5 angles"],
    H: Float[Tensor, "some 5 angles angles"],
    g: Float[Tensor, "some 5 angles"],
) -> tuple[Float[Tensor, "some 5 angles angles"], Float[Tensor, "some 5 angles"]]:
    """Return the equations without angles that are at an end of their range and would leave it."""
    alone = torch.linalg.solve(H, g)
    stuck = ((angles <= model.low) & ((g < 0) | (alone < 0))) | (
        (angles >= model.high) & ((g > 0) | (alone > 0))
    )
    free = (~stuck).float()
    H = H * free[..., None] * free[..., None, :]
    return H + torch.diag_embed(GRASP.rest * stuck), g * free


def _solved(
    H: Float[Tensor, "some 5 angles angles"],
    g: Float[Tensor, "some 5 angles"],
    place: Int[Tensor, "some 2"],
    angles: Float[Tensor, "rows keys 5 angles"],
) -> Float[Tensor, "rows keys 5 angles"]:
    """Return the step of all angles that also keeps them smooth in time (a banded system)."""
    rows, count = angles.shape[:2]
    row, key = place.T
    full = torch.eye(ANGLES).mul(GRASP.rest).repeat(rows, count, 5, 1, 1)
    right = torch.zeros_like(angles)
    full[row, key], right[row, key] = H, g
    change = GRASP.smoothness * angles.diff(dim=1)
    right[:, :-1] += change
    right[:, 1:] -= change
    ends = torch.full((count,), 2.0)
    ends[0] -= 1
    ends[-1] -= 1
    full = full + GRASP.smoothness * ends[:, None, None, None] * torch.eye(ANGLES)
    # One finger's key frames follow each other: neighbours are `ANGLES` apart.
    full = full.transpose(1, 2).reshape(-1, ANGLES, ANGLES).double().numpy()
    band = np.zeros((ANGLES + 1, len(full) * ANGLES))
    for k in range(ANGLES):
        diagonal = np.zeros((len(full), ANGLES))
        diagonal[:, : ANGLES - k] = np.diagonal(full, -k, axis1=1, axis2=2)
        band[k] = diagonal.ravel()
    linked = np.full((rows * 5, count, ANGLES), -GRASP.smoothness)
    linked[:, -1] = 0.0
    band[ANGLES] = linked.ravel()
    found = solveh_banded(
        band, right.transpose(1, 2).double().numpy().ravel(), lower=True, check_finite=False
    )
    step = torch.from_numpy(found).float().view(rows, 5, count, ANGLES)
    return step.transpose(1, 2)


def _interpolated(
    angles: Float[Tensor, "rows keys 5 angles"],
    keys: Int[Tensor, " keys"],
    row: Int[Tensor, " some"],
    frame: Int[Tensor, " some"],
) -> Float[Tensor, "some 5 angles"]:
    """Return angles of frames between key frames."""
    before = (torch.searchsorted(keys, frame, right=True) - 1).clamp(max=len(keys) - 2, min=0)
    after = (before + 1).clamp(max=len(keys) - 1)
    gap = (keys[after] - keys[before]).clamp(min=1)
    u = ((frame - keys[before]) / gap)[:, None, None]
    a, b = angles[row, before], angles[row, after]
    return a + u * (b - a)
