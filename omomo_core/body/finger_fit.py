"""Fingers of hands that hold, fitted to the object over time: Gauss-Newton with one banded system.

Residuals are in millimetres: skin is out of the object, pads are on its surface. Angles stay close to
their grip and change smoothly from key frame to key frame; each stays within its range.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.linalg import solveh_banded
from torch import Tensor

from omomo_core.body.body_config import GRASP, GRIP
from omomo_core.body.finger_model import ANGLES, THUMB, FingerModel, pose_fingers
from omomo_core.body.grip import HandPoses, crossed_bones, relaxed_angles
from omomo_core.geometry.distance_field import DistanceField

_MILLIMETRES = 1000


@dataclass(frozen=True)
class KeyFrames:
    """Key frames of sequences of one hand each, flattened: those in which fingers leave their rest."""

    poses: HandPoses
    place: Int[Tensor, "keys 2"]
    """Sequence and number of the key frame in it."""
    hold: Float[Tensor, " keys"]
    """How much the hand holds."""
    goal: Float[Tensor, "keys 5 angles"]
    """The grip, blended with the relaxed hand."""
    weight: Float[Tensor, " keys"]
    """Weight of each in the first, coarse steps: how many it stands for, or 0 where it is not measured."""

    def __getitem__(self, some: Tensor) -> "KeyFrames":
        return KeyFrames(
            self.poses[some], self.place[some], self.hold[some], self.goal[some], self.weight[some]
        )


def fit_fingers(
    model: FingerModel,
    keys: KeyFrames,
    rows: int,
    times: Int[Tensor, " times"],
    field: DistanceField,
) -> Float[Tensor, "rows times 5 angles"]:
    """Return the angles of all key frames that fit the object best (Gauss-Newton).

    Args:
        model: the fingers.
        keys: those in which they leave their rest.
        rows: how many sequences there are.
        times: frame of each key frame of a sequence.
        field: signed distance to the object.
    """
    angles = relaxed_angles().expand(rows, len(times), 5, ANGLES).clone()
    angles[tuple(keys.place.T)] = keys.goal
    few, thinned = keys[keys.weight > 0], model.thinned(GRASP.coarse_points)
    between = keys.place[keys.weight == 0]
    for left in range(GRASP.rounds, 0, -1):
        if left == GRASP.full_rounds:
            few, between = replace(keys, weight=torch.ones_like(keys.weight)), keys.place[:0]
        own = angles[tuple(few.place.T)]
        exact = left <= GRASP.exact_rounds
        skin = model if left == 1 else thinned
        equations = _contact_equations(skin, few, own, field, exact=exact)
        H, g = _within_ranges(model, own, *equations)
        weight = few.weight[:, None, None]
        step = _solved(weight[..., None] * H, weight * g, few.place, between, angles)
        angles = angles + step.clamp(-GRASP.longest_step, GRASP.longest_step)
        angles = slowed(torch.minimum(torch.maximum(angles, model.low), model.high), times)
    return _freed(model.thinned(GRASP.coarse_points), keys, angles, times, field)


def _freed(
    model: FingerModel,
    keys: KeyFrames,
    angles: Float[Tensor, "rows times 5 angles"],
    times: Int[Tensor, " times"],
    field: DistanceField,
) -> Float[Tensor, "rows times 5 angles"]:
    """Return the angles; stuck fingers take those of their grip if these are less deep in the object.

    The steps do not free a finger in the middle of a pole, because no side is nearer, nor one that passes
    through a thin wall, because its tip is outside of the object again.
    """
    place = tuple(keys.place.T)
    depth = _finger_depths(model, keys.poses, angles[place], field)
    key, finger = (depth > GRASP.stuck_depth).nonzero().T
    if not key.numel():
        return angles
    some = key.unique()
    of_grip = torch.zeros_like(depth)
    of_grip[some] = _finger_depths(model, keys.poses[some], keys.goal[some], field)
    better = of_grip[key, finger] < depth[key, finger]
    key, finger = key[better], finger[better]
    angles = angles.clone()
    angles[keys.place[key, 0], keys.place[key, 1], finger] = keys.goal[key, finger]
    return slowed(angles, times)


def _finger_depths(
    model: FingerModel,
    poses: HandPoses,
    angles: Float[Tensor, "hands 5 angles"],
    field: DistanceField,
) -> Float[Tensor, "hands 5"]:
    """Return how deep each finger is in the object, metres; one that crosses its surface counts as deeper."""
    posed = pose_fingers(model, poses.side, angles)
    deepest = -field.fine(poses.placed(posed.points)).amin(dim=-1)
    crossed = crossed_bones(poses.placed(posed.bones), field).any(dim=-1)
    return deepest.clamp(min=0.0) + GRASP.crossing_depth * crossed


def slowed(
    angles: Float[Tensor, "rows keys 5 angles"], times: Int[Tensor, " keys"]
) -> Float[Tensor, "rows keys 5 angles"]:
    """Return the nearest paths of angles through the key frames in which none is faster than a finger.

    The mean of the lowest path above and of the highest path below is as slow as both, and no path so slow
    has a smaller largest distance from the given one.
    """
    most = torch.tensor(GRASP.fastest, dtype=torch.double) * times[:, None, None]
    paths = angles.double()
    return (0.5 * (_slow_below(paths, most) - _slow_below(-paths, most))).to(angles)


def _slow_below(
    paths: Float[Tensor, "rows keys 5 angles"], most: Float[Tensor, "keys 1 angles"]
) -> Float[Tensor, "rows keys 5 angles"]:
    """Return the highest slow paths that are nowhere above the given ones.

    Args:
        paths: angles of the key frames.
        most: by how much each angle can have changed from frame 0 to each key frame.
    """
    before = (paths - most).cummin(dim=1).values + most
    after = (paths + most).flip(1).cummin(dim=1).values.flip(1) - most
    return torch.minimum(before, after)


def _contact_equations(
    model: FingerModel,
    keys: KeyFrames,
    angles: Float[Tensor, "keys 5 angles"],
    field: DistanceField,
    *,
    exact: bool,
) -> tuple[Float[Tensor, "keys 5 angles angles"], Float[Tensor, "keys 5 angles"]]:
    """Return the normal equations of each finger: depth, touch, and the posture of the grip."""
    posed = pose_fingers(model, keys.poses.side, angles)
    palmar = model.palmar[keys.poses.side]
    distance, out = _measured(keys.poses.placed(posed.points), palmar, field, exact=exact)
    local = (out.flatten(1, 2) @ keys.poses.R_object_wrist).view(out.shape)
    J = _MILLIMETRES * posed.slopes(local)
    weight, residual = _contact_residuals(keys, palmar, distance)
    # The last joint of a finger bends with the middle one.
    tie = torch.tensor([[0.0, 0.0, 0.0, -GRIP.last_joint, 1.0]]).repeat(5, 1)
    tie[THUMB] = 0.0
    stiff = torch.tensor(GRASP.stiffness)
    seen = torch.einsum("kfpa,kfp,kfpb->kfab", J, weight, J)
    H = seen + torch.diag(stiff) + GRASP.synergy * tie[:, :, None] * tie[:, None]
    g = -torch.einsum("kfpa,kfp->kfa", J, weight * residual) + stiff * (keys.goal - angles)
    return H, g - GRASP.synergy * (angles * tie).sum(dim=-1, keepdim=True) * tie


def _measured(
    points: Float[Tensor, "keys 5 points 3"],
    palmar: Bool[Tensor, "keys 5 points"],
    field: DistanceField,
    *,
    exact: bool,
) -> tuple[Float[Tensor, "keys 5 points"], Float[Tensor, "keys 5 points 3"]]:
    """Return the distance of points, and the direction in which it grows where they are near and count."""
    distance, out = field.at(points), torch.zeros_like(points)
    # Points inside count, and those of each phalanx that are nearest to the surface.
    gap = _palmar_gaps(distance, palmar)
    nearest = gap < gap.amin(dim=-1, keepdim=True) + GRASP.counting_range
    near = (distance < GRASP.touch_range) & (
        nearest.flatten(-2) | (distance < GRASP.counting_range)
    )
    close = near & (distance > -GRASP.exact_range) & (distance < GRASP.exact_range)
    if exact:
        distance[close], out[close] = field.exact(points[close])
        near = near & ~close
    out[near] = field.away(points[near])
    return distance, out


def _contact_residuals(
    keys: KeyFrames, palmar: Bool[Tensor, "keys 5 points"], distance: Float[Tensor, "keys 5 points"]
) -> tuple[Float[Tensor, "keys 5 points"], Float[Tensor, "keys 5 points"]]:
    """Return weights and residuals (millimetres) of the skin's points: out of the object, on its surface."""
    inside = distance < GRASP.margin
    nearest = torch.softmax(-_palmar_gaps(distance, palmar) / GRASP.pad_softness, dim=-1)
    wanted = torch.tensor(GRASP.touching)[:, None] * nearest
    reach = torch.exp(-(distance.clamp(min=0.0) / GRASP.touch_range).square())
    touch = keys.hold[:, None, None] * wanted.flatten(-2) * reach
    # A hand that only comes or goes may brush the object: its fingers are not snatched away.
    firm = GRASP.firmness * (GRASP.brushing + 2 * keys.hold).clamp(max=1.0)[:, None, None]
    weight = torch.where(inside, firm, touch)
    return weight, _MILLIMETRES * (distance - GRASP.margin)


def _palmar_gaps(
    distance: Float[Tensor, "keys 5 points"], palmar: Bool[Tensor, "keys 5 points"]
) -> Float[Tensor, "keys 5 3 phalanxpoints"]:
    """Return the distances of each phalanx's points; infinite for those of the back of a finger."""
    return distance.masked_fill(~palmar, torch.inf).unflatten(-1, (3, -1))


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
    left = H * free[..., None] * free[..., None, :]
    return left + torch.diag_embed(GRASP.rest * stuck), g * free


def _solved(
    H: Float[Tensor, "some 5 angles angles"],
    g: Float[Tensor, "some 5 angles"],
    place: Int[Tensor, "some 2"],
    between: Int[Tensor, "others 2"],
    angles: Float[Tensor, "rows keys 5 angles"],
) -> Float[Tensor, "rows keys 5 angles"]:
    """Return the step of all angles that also keeps them smooth in time (a banded system)."""
    rows, count = angles.shape[:2]
    row, key = place.T
    full = torch.eye(ANGLES).mul(GRASP.rest).repeat(rows, count, 5, 1, 1)
    right = torch.zeros_like(angles)
    full[row, key], right[row, key] = H, g
    full[tuple(between.T)] = 0.0
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
