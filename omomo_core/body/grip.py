"""Grips: how a hand may close on a surface, by name, and which one suits a place.

Every finger is tried in postures from open to closed. The one that touches most and enters nothing
is kept; the thumb gains most where it opposes the palm, on another face of what is held.
"""

from dataclasses import dataclass
from functools import lru_cache

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from omomo_core.body.body_config import GRIP, GRIP_NAMING
from omomo_core.body.finger_model import ANGLES, PER_PHALANX, THUMB, finger_model, pose_fingers
from omomo_core.body.kinematics import WRISTS
from omomo_core.body.model import BodyModel
from omomo_core.geometry.cheapest_path import cheapest_path
from omomo_core.geometry.distance_field import DistanceField
from omomo_core.skeleton import PALM_JOINTS


@dataclass(frozen=True)
class HandPoses:
    """Hands in the object's frame, metres."""

    R_object_wrist: Float[Tensor, "hands 3 3"]
    wrists: Float[Tensor, "hands 3"]
    side: Int[Tensor, " hands"]
    """0 left, 1 right."""

    def __getitem__(self, rows: Tensor) -> "HandPoses":
        return HandPoses(self.R_object_wrist[rows], self.wrists[rows], self.side[rows])

    def placed(self, points: Float[Tensor, "hands *b 3"]) -> Float[Tensor, "hands *b 3"]:
        """Return points that are given from the wrists in their axes, in the object's frame."""
        flat = points.flatten(1, -2) @ self.R_object_wrist.mT + self.wrists[:, None]
        return flat.view(points.shape)


@dataclass(frozen=True)
class _Postures:
    """Postures of the fingers of both hands, with their skin from the wrist."""

    angles: Float[Tensor, "2 fingers tries 5"]
    points: Float[Tensor, "2 fingers tries points 3"]
    palmar: Bool[Tensor, "2 fingers points"]
    """Which of them are on the palm's side."""
    bones: Float[Tensor, "2 fingers tries 4 3"]
    """The three joints and the middle of the last phalanx, from the wrist."""


def find_grips(
    body: BodyModel, poses: HandPoses, field: DistanceField
) -> Float[Tensor, "contacts 5 angles"]:
    """Return the angles of the fingers that hold best.

    Args:
        body: whose hands.
        poses: of the hands, `GRIP.poses` for each contact, one contact after the other.
        field: signed distance to the object.
    """
    fingers, thumb = _postures(body)
    found = [_best(p, f, poses, field) for f, p in ((slice(4), fingers), (slice(4, 5), thumb))]
    return torch.cat(found, dim=1)


def grip_worth(body: BodyModel, poses: HandPoses, field: DistanceField) -> Float[Tensor, " hands"]:
    """Return what the best posture of the fingers is worth for each hand, from a few postures.

    Args:
        body: whose hands.
        poses: of the hands.
        field: signed distance to the object.
    """
    total = torch.zeros(len(poses.side))
    for postures, which in zip(_postures(body, few=True), (slice(4), slice(4, 5)), strict=True):
        points, angles = poses.placed(postures.points[poses.side]), postures.angles[poses.side]
        palmar = postures.palmar[poses.side]
        worth = _worth(palmar, angles, points, field.at(points), which, poses, field)
        total = total + worth.amax(dim=-1).sum(dim=-1)
    return total


def _best(
    postures: _Postures, which: slice, poses: HandPoses, field: DistanceField
) -> Float[Tensor, "contacts fingers angles"]:
    """Return the angles of the posture of each finger that is worth most in all poses of a contact."""
    points = poses.placed(postures.points[poses.side])
    angles, palmar = postures.angles[poses.side], postures.palmar[poses.side]
    worth = _of_contacts(_worth(palmar, angles, points, field.at(points), which, poses, field))
    cost = _crossing_cost(postures, poses, field)
    # The grid hardly sees thin boards: the best postures are measured exactly.
    best = (worth - cost).topk(GRIP.finalists, dim=-1).indices
    few = best.repeat_interleave(GRIP.poses, dim=0)[..., None]
    points = points.gather(2, few[..., None].expand(-1, -1, -1, *points.shape[3:]))
    angles = angles.gather(2, few.expand(-1, -1, -1, ANGLES))
    distance = field.at(points)
    near = distance.abs() < GRIP.exact_range
    distance[near] = field.exact(points[near])[0]
    worth = _of_contacts(_worth(palmar, angles, points, distance, which, poses, field))
    return _best_together(worth - cost.gather(-1, best), angles[:: GRIP.poses])


def _best_together(
    worth: Float[Tensor, "contacts fingers tries"],
    angles: Float[Tensor, "contacts fingers tries angles"],
) -> Float[Tensor, "contacts fingers angles"]:
    """Return the postures that are worth most together: each finger bends like the one beside it."""
    apart = (angles[:, :-1, :, None] - angles[:, 1:, None]).square().sum(dim=-1)
    best = cheapest_path(-worth, GRIP.apart_cost * apart)[..., None, None]
    return angles.gather(-2, best.expand(-1, -1, 1, ANGLES))[..., 0, :]


def _crossing_cost(
    postures: _Postures, poses: HandPoses, field: DistanceField
) -> Float[Tensor, "contacts fingers tries"]:
    """Return the cost of fingers that pass through the surface, in the middle pose of each contact.

    Their depth does not tell: on either side of a thin wall a finger is outside.
    """
    middle = poses[torch.arange(GRIP.poses // 2, len(poses.side), GRIP.poses)]
    bones = middle.placed(postures.bones[middle.side])
    return GRIP.crossing_cost * crossed_bones(bones, field).sum(dim=-1)


def crossed_bones(bones: Float[Tensor, "*b 4 3"], field: DistanceField) -> Bool[Tensor, "*b 3"]:
    """Return which bones of fingers pass through the surface; from joint to joint, object's frame."""
    return field.crossed(bones[..., :-1, :], bones[..., 1:, :])


def _of_contacts(
    worth: Float[Tensor, "hands fingers tries"],
) -> Float[Tensor, "contacts fingers tries"]:
    """Return what postures are worth on average over the poses of each contact."""
    return worth.unflatten(0, (-1, GRIP.poses)).mean(dim=1)


def _worth(
    palmar: Bool[Tensor, "hands fingers points"],
    angles: Float[Tensor, "hands fingers tries angles"],
    points: Float[Tensor, "hands fingers tries points 3"],
    distance: Float[Tensor, "hands fingers tries points"],
    which: slice,
    poses: HandPoses,
    field: DistanceField,
) -> Float[Tensor, "hands fingers tries"]:
    """Return what postures are worth: touch and opposition, less depth and distance from rest."""
    gap = distance.clamp(min=0.0).masked_fill(~palmar[:, :, None], torch.inf)
    near, nearest = gap.unflatten(-1, (3, -1)).min(dim=-1)
    touch = torch.exp(-near / GRIP.touch_distance)
    pad = (nearest[..., 2] + 2 * gap.shape[-1] // 3)[..., None, None]
    pads = points.gather(-2, pad.expand(*pad.shape[:-1], 3))[..., 0, :]
    opposed = 0.5 * (1 - (field.away(pads) * poses.R_object_wrist[:, None, None, :, 1]).sum(dim=-1))
    gain = torch.tensor([GRIP.opposition] * 4 + [GRIP.thumb_opposition])[which, None]
    worth = touch @ torch.tensor(GRIP.touching) + gain * opposed * touch[..., 2]
    depth = (-distance.amin(dim=-1) - GRIP.allowed_depth).clamp(min=0.0)
    idle = (angles - relaxed_angles()[which, None]).square().sum(dim=-1)
    return worth - GRIP.depth_cost * depth - GRIP.idle_cost * idle


@lru_cache(maxsize=8)
def _postures(body: BodyModel, *, few: bool = False) -> tuple[_Postures, _Postures]:
    """Return the postures of the four fingers, and those of the thumb, that are tried.

    Args:
        body: whose hands.
        few: of each angle every second value alone, and a quarter of a phalanx's points, those which
            are the farthest apart.
    """
    step = 2 if few else 1
    bend, curl = torch.cartesian_prod(
        torch.tensor(GRIP.bends[::step]), torch.tensor(GRIP.curls[::step])
    ).T
    zero = torch.zeros_like(bend)
    finger = torch.stack([bend, zero, zero, curl, GRIP.last_joint * curl], dim=-1)
    swing, lift, turn, curl = torch.cartesian_prod(
        *(
            torch.tensor(x[::step])
            for x in (GRIP.thumb_bends, GRIP.thumb_lifts, GRIP.thumb_turns, GRIP.thumb_curls)
        )
    ).T
    thumb = torch.stack([swing, lift, turn, curl, curl], dim=-1)
    points = PER_PHALANX // 4 if few else PER_PHALANX
    return _tried(body, finger, slice(4), points), _tried(body, thumb, slice(THUMB, 5), points)


def _tried(
    body: BodyModel, angles: Float[Tensor, "tries 5"], which: slice, count: int
) -> _Postures:
    """Return postures with so many points of each phalanx."""
    model = finger_model(body).thinned(count)
    every = angles[:, None].expand(-1, 5, -1)
    posed = [pose_fingers(model, torch.full((len(angles),), side), every) for side in range(2)]
    skin, bones = (
        torch.stack([x[:, which] for x in of_hands]).transpose(1, 2)
        for of_hands in ([p.points for p in posed], [p.bones for p in posed])
    )
    return _Postures(
        angles=angles.expand(2, skin.shape[1], -1, -1),
        points=skin.contiguous(),
        palmar=model.palmar[:, which],
        bones=bones,
    )


def relaxed_angles() -> Float[Tensor, "5 angles"]:
    """Return the angles of a relaxed hand."""
    angles = torch.zeros(5, ANGLES)
    angles[:4, [0, 3, 4]] = torch.tensor(GRIP.relaxed)
    return angles


def opened_angles(grip: Float[Tensor, "some 5 angles"]) -> Float[Tensor, "some 5 angles"]:
    """Return the angles of a hand that opens for a grip: bent less, but fingers as far bent back.

    The base of the thumb does not open, so that the thumb stays on its side of what is held.
    """
    opened = GRIP.opened * grip
    opened[:, :THUMB] = torch.minimum(opened[:, :THUMB], grip[:, :THUMB])
    opened[:, THUMB, :3] = grip[:, THUMB, :3]
    return opened


GRIPS = (
    "free",
    "flat press",
    "weight on a top",
    "hooked edge",
    "cupped corner",
    "pinched board",
    "power grip",
)
"""Grips by number: a free hand; a palm on a face, from the side or above; fingers over an edge, or over two;
thumb and fingers on the faces of a thin board; fingers around a bar."""


def name_grips(
    body: BodyModel,
    poses: HandPoses,
    up: Float[Tensor, "contacts 3"],
    field: DistanceField,
) -> Int[Tensor, " contacts"]:
    """Return the number of each contact's grip in `GRIPS`.

    Args:
        body: whose hands.
        poses: of one hand for each contact.
        up: the world's vertical in the object's frame.
        field: signed distance to the object.
    """
    if not len(up):
        return torch.zeros(0, dtype=torch.long)
    rest = body.rest_joints.float()
    ways = rest[list(PALM_JOINTS)] - rest[list(WRISTS)]
    x, y, z = poses.R_object_wrist.unbind(dim=-1)
    palm = poses.placed(ways[poses.side][:, None])[:, 0] - GRIP_NAMING.palm_thickness * y
    thickness = _extent(palm, -y, field)
    within = palm - (0.5 * thickness).clamp(max=GRIP_NAMING.below)[:, None] * y
    fingers = torch.where(poses.side == 0, 1.0, -1.0)[:, None] * x
    ahead, behind, thumb, little = (_extent(within, w, field) for w in (fingers, -fingers, z, -z))
    thin = thickness < GRIP_NAMING.bar
    bar = thin & (torch.minimum(ahead + behind, thumb + little) < GRIP_NAMING.bar)
    beside = torch.minimum(thumb, little) < GRIP_NAMING.thumb_reach
    over = ahead < GRIP_NAMING.finger_reach
    board = (thickness < GRIP_NAMING.board) & (over | beside)
    top = (y * up).sum(dim=-1) > GRIP_NAMING.level_cosine
    grips = torch.full_like(poses.side, GRIPS.index("flat press"))
    for name, found in (
        ("weight on a top", top),
        ("hooked edge", over),
        ("cupped corner", over & beside),
        ("pinched board", board),
        ("power grip", bar),
    ):
        grips[found] = GRIPS.index(name)
    return grips


def _extent(
    start: Float[Tensor, "contacts 3"], way: Float[Tensor, "contacts 3"], field: DistanceField
) -> Float[Tensor, " contacts"]:
    """Return how far the object goes on from a place on it or in it along a direction, metres."""
    steps = torch.arange(1, GRIP_NAMING.probes + 1) * GRIP_NAMING.spacing
    points = start[:, None] + steps[:, None] * way[:, None]
    distance = field.exact(points.flatten(0, 1))[0].view(len(start), -1)
    outside = (distance > 0) & (steps > GRIP_NAMING.entry)
    return torch.where(outside, steps, steps[-1] + GRIP_NAMING.spacing).amin(dim=1)
