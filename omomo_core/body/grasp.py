"""Grasp: fingers close on the object that a hand holds, each by one synergy.

Each finger has one degree of freedom, from an open hand to a fist, its joints in a fixed proportion;
the thumb may also be turned, from beside the palm to against the fingers. Of these postures each
finger takes the one that touches most of the surface and enters none of it, so it lies on a wall and
wraps around a pole. What meets no surface stays half open.
"""

from dataclasses import dataclass

import roma
import torch
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d
from torch import Tensor
from torch.nn.functional import normalize

from omomo_core.body.config import GRASP
from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.geometry.distance_field import DistanceField

FINGERS, THUMB = slice(0, 4), 4
"""Of the five of a hand, in the skeleton's order: index, middle, pinky, ring, thumb."""
_OPEN = torch.tensor([GRASP.open_finger] * 4 + [GRASP.open_thumb])
_FIST = torch.tensor([GRASP.closed_finger] * 4 + [GRASP.closed_thumb])
"""Flexion of the three joints of all five, radians."""

_TURNS = torch.tensor(GRASP.thumb_turns)
CHUNK = 1024
"""Hands solved at once."""
_SPHERE_POSITIONS = torch.tensor(GRASP.sphere_positions)


@dataclass(frozen=True)
class ClosedFingers:
    """Finger rotations of both hands, and how deep fingers are inside the object."""

    fingers: Float[Tensor, "*b frames 30 3 3"]
    """Rotation of each finger joint relative to its parent."""
    depth: Float[Tensor, "*b frames 2"]
    """Depth of the deepest finger of the left and the right hand, metres; 0 where none is inside."""


@dataclass(frozen=True)
class _Hands:
    """Both hands (left, right) at rest, their flesh as spheres; rest axes, metres, radians."""

    offsets: Float[Tensor, "2 5 3 3"]
    """From each joint's parent to it."""
    spheres: Float[Tensor, "2 5 3 2 3"]
    """Their centres from the bone's joint."""
    radius: Float[Tensor, "2 5 3 2"]
    axis: Float[Tensor, "2 5 3"]
    """About which a finger bends."""
    spread: Float[Tensor, "2 5"]
    """Turn about the vertical that lays a finger along the hand."""
    thumb: Float[Tensor, " 2"]
    """Turn of the resting thumb from flat."""


_Poses = tuple[Float[Tensor, "hands 3 3"], Float[Tensor, "hands 3"], Int[Tensor, " hands"]]
"""R_object_wrist, the wrist in the object's frame, and which hand: 0 left, 1 right."""


@dataclass(frozen=True)
class _Choices:
    """Postures to choose from for some fingers of both hands."""

    centres: Float[Tensor, "2 fingers turns closings 6 3"]
    """Spheres from the wrist joint, wrist axes."""
    radius: Float[Tensor, "2 fingers 6"]
    merit: Float[Tensor, "2 fingers turns closings"]
    """What a posture is worth wherever the object is."""


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
    hands = _hands(body)
    R_object_world = T_world_object[:, None, :3, :3].mT.float()
    R_object_wrist = R_object_world @ R_world_wrist.float()
    shift = (wrists - T_world_object[:, None, :3, 3]).float()
    at = (R_object_world @ shift[..., None])[..., 0]
    seen = weight.float().clone()
    seen[..., [k for k in range(seen.shape[-2]) if k % GRASP.stride], :] = 0.0
    poses = (R_object_wrist.flatten(0, -4), at.flatten(0, -3))
    found = _postures(hands, *poses, field, (seen > 0).flatten(0, -2))
    closing, turn = (x.view(*seen.shape, x.shape[-1]) for x in found)
    held = _rotations(
        hands, _smoothed(closing, seen, GRASP.idle_closing), _smoothed(turn, seen, GRASP.idle_turn)
    )
    relaxed = body.relaxed_fingers.view(2, 5, 3, 3, 3)
    step = roma.rotmat_to_rotvec(relaxed.mT @ held)
    fingers = relaxed @ roma.rotvec_to_rotmat(weight.float()[..., None, None, None] * step)
    points = _centres(hands, fingers).flatten(-4, -2)
    distance = field.at(points @ R_object_wrist.mT + at[..., None, :])
    depth = (hands.radius.flatten(1) - distance).amax(dim=-1).clamp(min=0.0)
    return ClosedFingers(fingers.flatten(-5, -3), depth)


def _postures(
    hands: _Hands,
    R_object_wrist: Float[Tensor, "times 2 3 3"],
    at: Float[Tensor, "times 2 3"],
    field: DistanceField,
    holds: Bool[Tensor, "times 2"],
) -> tuple[Float[Tensor, "times 2 5"], Float[Tensor, "times 2 1"]]:
    """Return how far each finger closes (0 open to 1 fist), and how far each thumb is turned."""
    fingers, thumb = _choices(hands, FINGERS, _TURNS[:1]), _choices(hands, slice(4, 5), _TURNS)
    closing = torch.full((*holds.shape, 5), GRASP.idle_closing)
    turn = torch.full((*holds.shape, 1), GRASP.idle_turn)
    for rows in holds.nonzero().split(CHUNK):
        frame, side = rows.T
        poses = (R_object_wrist[frame, side], at[frame, side], side)
        found = [_best(choices, poses, field) for choices in (fingers, thumb)]
        closing[frame, side] = torch.cat([c for _, c in found], dim=1) / (GRASP.closings - 1)
        turn[frame, side] = _TURNS[found[1][0]]
    return closing, turn


def _best(
    choices: _Choices, poses: _Poses, field: DistanceField
) -> tuple[Int[Tensor, "hands fingers"], Int[Tensor, "hands fingers"]]:
    """Return the indices of the turn and of the closing in which each finger holds best."""
    fingers, turns = choices.merit.shape[1:3]
    side, finger = poses[2][:, None, None, None], torch.arange(fingers)[:, None, None]
    turn, tried = (
        torch.arange(turns)[:, None],
        torch.arange(0, GRASP.closings, GRASP.closing_stride),
    )
    worth = _worth(choices, (side, finger, turn, tried), poses, field)
    best = worth.flatten(2).argmax(dim=-1)[..., None, None]
    turn, rough = best // len(tried), tried[best % len(tried)]
    near = (rough + torch.arange(1 - GRASP.closing_stride, GRASP.closing_stride)).clamp(
        0, GRASP.closings - 1
    )
    worth = _worth(choices, (side, finger, turn, near), poses, field)
    closing = near.gather(-1, worth.argmax(dim=-1, keepdim=True))
    return turn[..., 0, 0], closing[..., 0, 0]


def _worth(
    choices: _Choices, which: tuple[Int[Tensor, "..."], ...], poses: _Poses, field: DistanceField
) -> Float[Tensor, "hands fingers turns tries"]:
    """Return the share of a finger that touches, less a cost of depth, plus the merit of its posture.

    Postures that a closing finger reaches only through the surface do not count.
    """
    R_object_wrist, at, _ = poses
    centres = choices.centres[which]
    points = centres.flatten(1, 4) @ R_object_wrist.mT + at[:, None]
    gap = field.at(points).view(centres.shape[:-1]) - choices.radius[which[:2]]
    touch = torch.exp(-gap.clamp(min=0.0) / GRASP.touch_distance).mean(dim=-1)
    excess = (-gap.amin(dim=-1) - GRASP.allowed_depth).clamp(min=0.0)
    free = excess == 0
    passed = ((free.cumsum(dim=-1) > 0) & ~free).cumsum(dim=-1) > 0
    worth = (
        (1 + GRASP.opposition * _TURNS[which[2]]) * touch
        - GRASP.depth_cost * excess
        + choices.merit[which]
    )
    return worth.masked_fill(passed, -torch.inf)


def _choices(hands: _Hands, which: slice, turns: Float[Tensor, " turns"]) -> _Choices:
    """Return every posture of some of a hand's fingers."""
    closing = torch.linspace(0, 1, GRASP.closings)
    shape = (len(turns), GRASP.closings, 2)
    rotations = _rotations(
        hands,
        closing[:, None, None].expand(*shape, 5),
        turns[:, None, None, None].expand(*shape, 1),
    )
    centres = _centres(hands, rotations).flatten(-3, -2)[:, :, :, which].permute(2, 3, 0, 1, 4, 5)
    radius = hands.radius[:, which].flatten(2)
    merit = -GRASP.idle_cost * (
        closing - GRASP.idle_closing
    ) ** 2 - GRASP.depth_cost * _palm_penetration(hands, centres, radius)
    return _Choices(centres.contiguous(), radius, merit)


def _palm_penetration(
    hands: _Hands,
    centres: Float[Tensor, "2 fingers turns closings 6 3"],
    radius: Float[Tensor, "2 fingers 6"],
) -> Float[Tensor, "2 fingers turns closings"]:
    """Return how deep the outer two bones of fingers are inside the palm's bones, metres."""
    knuckles, flesh = hands.offsets[:, :2, 0], hands.spheres[:, :2, 0].mean(dim=2)
    palm = torch.stack([k * knuckles for k in GRASP.palm_positions], dim=2) + (
        flesh - hands.offsets[:, :2, 1] * _SPHERE_POSITIONS.mean()
    ).unsqueeze(2)
    apart = torch.cdist(centres[..., 2:, :].flatten(1, 4), palm.flatten(1, 2))
    apart = apart.amin(dim=-1).view(*centres.shape[:4], 4)
    thick = radius[:, :, None, None, 2:] + hands.radius[:, :1, None, :1, :1]
    return (thick - apart).clamp(min=0.0).amax(dim=-1)


def _rotations(
    hands: _Hands, closing: Float[Tensor, "*b 2 5"], turn: Float[Tensor, "*b 2 1"]
) -> Float[Tensor, "*b 2 5 3 3 3"]:
    """Return the rotation of each finger joint relative to its parent in a posture."""
    # The palm is in the way of a thumb beside it: only a round one bends.
    bend = torch.cat([closing[..., FINGERS], closing[..., THUMB:] * turn**2], dim=-1)
    angle = _OPEN + bend[..., None] * (_FIST - _OPEN)
    bent = roma.rotvec_to_rotmat(angle[..., None] * hands.axis[:, :, None])
    aside = torch.zeros(*closing.shape, 3)
    aside[..., 1] = GRASP.gather * closing * hands.spread
    aside[..., THUMB, 0] = (
        GRASP.flat_thumb + turn[..., 0] * (GRASP.round_thumb - GRASP.flat_thumb) - hands.thumb
    )
    first = roma.rotvec_to_rotmat(aside) @ bent[..., 0, :, :]
    return torch.cat([first[..., None, :, :], bent[..., 1:, :, :]], dim=-3)


def _centres(
    hands: _Hands, rotations: Float[Tensor, "*b 2 5 3 3 3"]
) -> Float[Tensor, "*b 2 5 3 2 3"]:
    """Return the centres of the spheres of bent fingers, from the wrist joint, wrist axes, metres."""
    turned, joint = torch.eye(3), torch.zeros(3)
    found: list[Tensor] = []
    for k in range(3):
        joint = joint + (turned @ hands.offsets[:, :, k, :, None])[..., 0]
        turned = turned @ rotations[..., k, :, :]
        found.append(joint[..., None, :] + hands.spheres[:, :, k] @ turned.mT)
    return torch.stack(found, dim=-3)


def _smoothed(
    x: Float[Tensor, "*b frames 2 n"], weight: Float[Tensor, "*b frames 2"], idle: float
) -> Float[Tensor, "*b frames 2 n"]:
    """Return `x` smoothed over the frames in which hands hold; `idle` far from them."""
    share = weight[..., None].clamp(min=1e-9)
    sums = (
        gaussian_filter1d(s.numpy(), GRASP.smoothing, axis=-3, mode="nearest")
        for s in (x * share, share)
    )
    above, below = (torch.from_numpy(s) for s in sums)
    return (above + 1e-6 * idle) / (below + 1e-6)


def _hands(body: BodyModel) -> _Hands:
    """Measure the hands of a body in its T-pose, palms down."""
    joints = body.rest_joints[22:].view(2, 5, 3, 3)
    wrists = body.rest_joints[list(WRISTS)][:, None, None].expand(2, 5, 1, 3)
    bones = joints.diff(dim=2)
    bones = torch.cat([bones, bones[:, :, -1:]], dim=2)
    spheres, radius = _flesh(body, joints, bones)
    mirror = torch.tensor([[1.0], [-1.0]])
    along = joints[:, :, 2] - joints[:, :, 0]
    down = torch.tensor([0.0, -1.0, 0.0]).expand_as(along)
    axis = normalize(torch.linalg.cross(along, down), dim=-1)
    spread = mirror * torch.atan2(along[..., 2], mirror * along[..., 0])
    thumb = torch.atan2(-along[:, THUMB, 1], along[:, THUMB, 2])
    level = torch.stack([torch.zeros(2), thumb.cos(), thumb.sin()], dim=-1)
    axis[:, THUMB], spread[:, THUMB] = mirror * level, 0.0
    offsets = joints - torch.cat([wrists, joints[:, :, :2]], dim=2)
    return _Hands(offsets, spheres, radius, axis, spread, thumb)


def _flesh(
    body: BodyModel, joints: Float[Tensor, "2 5 3 3"], bones: Float[Tensor, "2 5 3 3"]
) -> tuple[Float[Tensor, "2 5 3 2 3"], Float[Tensor, "2 5 3 2"]]:
    """Return the centres and radii of two spheres in each bone, as thick as the skin that follows it."""
    strongest = body.skin_weights.argmax(dim=1, keepdim=True)
    follows = body.skin_joints.gather(1, strongest)[:, 0]
    spheres, radii = torch.zeros(30, 2, 3), torch.zeros(30, 2)
    for k, (joint, bone) in enumerate(zip(joints.view(-1, 3), bones.view(-1, 3), strict=True)):
        skin = body.vertices[follows == 22 + k] - joint
        length, along = bone.norm(), bone / bone.norm()
        reach = skin @ along
        side = skin - reach[:, None] * along
        middle = side.mean(dim=0)
        radii[k] = radius = (side - middle).norm(dim=1).median()
        if k % 3 == 2:  # the last bone ends inside the fingertip
            length = (reach.max() - radius) / _SPHERE_POSITIONS[1]
        spheres[k] = middle + _SPHERE_POSITIONS[:, None] * length * along
    return spheres.view(2, 5, 3, 2, 3), radii.view(2, 5, 3, 2)
