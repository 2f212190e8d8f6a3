"""The fingers as a kinematic model, and their skin.

A finger has five angles: flexion, abduction and twist at its base, and the flexion of its two outer
joints. The thumb's base is its saddle joint in the palm; the other fingers do not twist.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import roma
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor
from torch.nn.functional import normalize

from omomo_core.body.body_config import FINGER_RANGES, HAND_SKIN
from omomo_core.body.kinematics import WRISTS, vertex_normals
from omomo_core.body.model import BodyModel

PALM, THUMB = -1, 4
"""Values of `HandSkin.finger`; index, middle, pinky, ring and thumb are 0 to 4, as in the skeleton."""


@dataclass(frozen=True)
class HandSkin:
    """Vertices of one hand from the heel of the palm to the fingertips."""

    vertices: Int[Tensor, " verts"]
    """Indices into the body's vertices."""
    finger: Int[Tensor, " verts"]
    """Which finger each belongs to; `PALM` for none."""
    phalanx: Int[Tensor, " verts"]
    """0, 1, 2 from the knuckle to the tip; the thumb's first is its palm bone."""
    pad: Bool[Tensor, " verts"]
    """On the palmar side of a last phalanx."""


@lru_cache(maxsize=4)
def hand_skins(body: BodyModel) -> tuple[HandSkin, HandSkin]:
    """Return the skin of the left and the right hand."""
    normals = vertex_normals(body.vertices, body.faces)
    strongest = body.skin_weights.argmax(dim=1, keepdim=True)
    bone = body.skin_joints.gather(1, strongest)[:, 0]
    palmar = palmar_directions(body)
    return _hand_skin(body, 0, bone, normals, palmar), _hand_skin(body, 1, bone, normals, palmar)


def _hand_skin(
    body: BodyModel,
    side: int,
    bone: Int[Tensor, " all"],
    normals: Float[Tensor, "all 3"],
    palmar: Float[Tensor, "2 5 3"],
) -> HandSkin:
    wrist, first = WRISTS[side], 22 + 15 * side
    knuckle = body.rest_joints[first + 3] - body.rest_joints[wrist]
    along = (body.vertices - body.rest_joints[wrist]) @ knuckle / knuckle.square().sum()
    link = bone - first
    fingers = (link >= 0) & (link < 15)
    chosen = (fingers | ((bone == wrist) & (along > HAND_SKIN.heel))).nonzero()[:, 0]
    finger = torch.where(fingers, link // 3, PALM)[chosen]
    phalanx = torch.where(fingers, link % 3, 0)[chosen]
    faces_palm = (normals[chosen] * palmar[side, finger]).sum(dim=-1) > HAND_SKIN.pad_cosine
    return HandSkin(chosen, finger, phalanx, (finger != PALM) & (phalanx == 2) & faces_palm)


def palmar_directions(body: BodyModel) -> Float[Tensor, "2 5 3"]:
    """Return the direction in which the pad of each finger of both hands looks at rest, unit length."""
    joints = body.rest_joints[22:].view(2, 5, 3, 3)
    along = normalize(joints[:, :, 2] - joints[:, :, 1], dim=-1)
    palmar = torch.tensor([0.0, -1.0, 0.0]).repeat(2, 5, 1)
    palmar[:, THUMB] = torch.stack([_nail(body, side, along[side, THUMB]) for side in range(2)])
    palmar = palmar - (palmar * along).sum(dim=-1, keepdim=True) * along
    return normalize(palmar, dim=-1)


def _nail(body: BodyModel, side: int, along: Float[Tensor, "3"]) -> Float[Tensor, "3"]:
    """Return where the thumb's pad looks: its tip is flattest from nail to pad."""
    tip = 22 + 15 * side + 3 * THUMB + 2
    strongest = body.skin_weights.argmax(dim=1, keepdim=True)
    skin = body.vertices[body.skin_joints.gather(1, strongest)[:, 0] == tip]
    beside = skin - (skin @ along)[:, None] * along
    axes = torch.linalg.svd(beside - beside.mean(dim=0), full_matrices=False)[2]
    return axes[1] * torch.sign(axes[1] @ torch.tensor([0.0, -1.0, -1.0]))


ANGLES = 5
"""Angles of a finger: flexion, abduction and twist at its base, flexion of its middle and last joint."""
PER_PHALANX = 20
"""Points on the skin of each phalanx, as far from each other as they can be."""
_PALM_POINTS = 60
"""Points on the skin of the palm."""


@dataclass(frozen=True)
class FingerModel:
    """The fingers of both hands (left, right) at rest: rest axes, metres, radians."""

    offsets: Float[Tensor, "2 5 3 3"]
    """From each joint's parent to it; of the first, from the wrist."""
    flexion: Float[Tensor, "2 5 3"]
    """Axes about which fingers bend towards the palm."""
    abduction: Float[Tensor, "2 5 3"]
    twist: Float[Tensor, "2 5 3"]
    skin: Float[Tensor, "2 5 points 3"]
    """Points on the skin, from the wrist."""
    shares: Float[Tensor, "2 5 points 4"]
    """Share of the wrist and of the three bones in each point."""
    phalanx: Int[Tensor, "2 5 points"]
    palmar: Bool[Tensor, "2 5 points"]
    """Skin of the palmar side."""
    low: Float[Tensor, "5 5"]
    """Least angles of each finger."""
    high: Float[Tensor, "5 5"]
    palm: Float[Tensor, "2 palmpoints 3"]
    """Points on the skin of the palm, from the wrist."""

    @cached_property
    def weighted_skin(self) -> Float[Tensor, "2 5 3 points 4"]:
        """Homogeneous positions of skin from each joint of its finger, times the share of its bone."""
        start = self.offsets.cumsum(dim=-2)
        way = self.skin[:, :, None] - start[..., None, :]
        share = self.shares[..., 1:].mT[..., None]
        return share * torch.cat([way, torch.ones_like(share)], dim=-1)

    @cached_property
    def following(self) -> Float[Tensor, "2 5 3 points 1"]:
        """Share of the skin's motion that follows each joint of its finger and those beyond it."""
        return _from_last(self.shares[..., 1:].mT[..., None])

    def thinned(self, count: int) -> "FingerModel":
        """Return the same fingers with so many points of each phalanx, which are the farthest apart."""
        some = (torch.arange(3)[:, None] * PER_PHALANX + torch.arange(count)).flatten()
        return replace(
            self,
            skin=self.skin[:, :, some],
            shares=self.shares[:, :, some],
            phalanx=self.phalanx[:, :, some],
            palmar=self.palmar[:, :, some],
        )


@dataclass(frozen=True)
class PosedFingers:
    """Skin of posed fingers with its derivatives, in the wrist's axes from the wrist, metres."""

    points: Float[Tensor, "*b 5 points 3"]
    axes: Float[Tensor, "*b 5 angles 3"]
    """About which each angle turns."""
    levers: Float[Tensor, "*b 5 3 points 3"]
    """From each of the three joints to the points that it turns, as far as it turns them."""
    joints: Float[Tensor, "*b 5 3 3"]

    @property
    def bones(self) -> Float[Tensor, "*b 5 4 3"]:
        """The joints of each finger and the middle of its last phalanx."""
        last = self.points.unflatten(-2, (3, -1))[..., 2, :, :].mean(dim=-2, keepdim=True)
        return torch.cat([self.joints, last], dim=-2)

    def slopes(self, out: Float[Tensor, "*b 5 points 3"]) -> Float[Tensor, "*b 5 points angles"]:
        """Return how far each angle moves each point along `out`, metres for each radian."""
        moment = torch.linalg.cross(self.levers, out[..., None, :, :].expand_as(self.levers))
        base = moment[..., 0, :, :] @ self.axes[..., :3, :].mT
        outer = (moment[..., 1:, :, :] * self.axes[..., 3:, None, :]).sum(dim=-1).mT
        return torch.cat([base, outer], dim=-1)


def rotations(
    model: FingerModel, side: Int[Tensor, " b"], angles: Float[Tensor, "b 5 angles"]
) -> Float[Tensor, "b 5 3 3 3"]:
    """Return the rotation of each joint relative to its parent."""
    flexion = model.flexion[side]
    bend, spread, twist, middle, last = (x[..., None] for x in angles.unbind(dim=-1))
    base = (
        roma.rotvec_to_rotmat(spread * model.abduction[side])
        @ roma.rotvec_to_rotmat(bend * flexion)
        @ roma.rotvec_to_rotmat(twist * model.twist[side])
    )
    outer = [roma.rotvec_to_rotmat(x * flexion) for x in (middle, last)]
    return torch.stack([base, *outer], dim=-3)


def pose_fingers(
    model: FingerModel, side: Int[Tensor, " b"], angles: Float[Tensor, "b 5 angles"]
) -> PosedFingers:
    """Return the skin of the fingers of hands, and how angles move it."""
    local = rotations(model, side, angles)
    joints, turned = _chain(model.offsets[side], local)
    carried = _carried(model, side, torch.cat([turned.mT, joints[..., None, :]], dim=-2))
    beyond = _from_last(carried)
    levers = beyond - model.following[side] * joints[..., None, :]
    still = (model.shares[..., :1] * model.skin)[side]
    flexion, spread = model.flexion[side], model.abduction[side]
    opened = roma.rotvec_to_rotmat(angles[..., 1:2] * spread)
    axes = [
        (opened @ flexion[..., None])[..., 0],
        spread,
        (turned[..., 0, :, :] @ model.twist[side][..., None])[..., 0],
        (turned[..., 0, :, :] @ flexion[..., None])[..., 0],
        (turned[..., 1, :, :] @ flexion[..., None])[..., 0],
    ]
    return PosedFingers(still + beyond[..., 0, :, :], torch.stack(axes, dim=-2), levers, joints)


def _carried(
    model: FingerModel, side: Int[Tensor, " b"], bones: Float[Tensor, "b 5 3 4 3"]
) -> Float[Tensor, "b 5 3 points 3"]:
    """Return the part of each joint in the place of each point: one product for all hands of a side."""
    skin = model.weighted_skin
    carried = bones.new_empty(len(side), *skin.shape[1:4], 3)
    for own in range(2):
        of_side = (side == own).nonzero()[:, 0]
        carried[of_side] = torch.einsum("fjpk,bfjkx->bfjpx", skin[own], bones[of_side])
    return carried


def _from_last(x: Float[Tensor, "*b 3 points n"]) -> Float[Tensor, "*b 3 points n"]:
    """Return the sum of each joint's part and of those beyond it."""
    base, middle, last = x.unbind(dim=-3)
    outer = last + middle
    return torch.stack([outer + base, outer, last], dim=-3)


def _chain(
    offsets: Float[Tensor, "*b 3 3"], local: Float[Tensor, "*b 3 3 3"]
) -> tuple[Float[Tensor, "*b 3 3"], Float[Tensor, "*b 3 3 3"]]:
    """Return joints and rotations in the wrist's axes."""
    joint = offsets[..., 0, :]
    joints, turned = [joint], [local[..., 0, :, :]]
    for k in (1, 2):
        joint = joint + (turned[-1] @ offsets[..., k, :, None])[..., 0]
        joints.append(joint)
        turned.append(turned[-1] @ local[..., k, :, :])
    return torch.stack(joints, dim=-2), torch.stack(turned, dim=-3)


@lru_cache(maxsize=4)
def finger_model(body: BodyModel) -> FingerModel:
    """Measure the fingers of a body in its T-pose, palms down."""
    joints = body.rest_joints[22:].view(2, 5, 3, 3)
    wrists = body.rest_joints[list(WRISTS)][:, None, None].expand(2, 5, 1, 3)
    palmar = palmar_directions(body)
    along = normalize(joints[:, :, 2] - joints[:, :, 1], dim=-1)
    mirror = torch.tensor([1.0, -1.0])[:, None, None]
    parts = [_points(body, side, hand, palmar) for side, hand in enumerate(hand_skins(body))]
    skin, shares, phalanx, faces = (torch.stack(x) for x in zip(*parts, strict=True))
    ranges = torch.tensor([*[FINGER_RANGES.finger] * 4, FINGER_RANGES.thumb])
    return FingerModel(
        offsets=joints - torch.cat([wrists, joints[:, :, :2]], dim=2),
        flexion=normalize(torch.linalg.cross(along, palmar), dim=-1),
        abduction=mirror * palmar,
        twist=mirror * along,
        skin=skin,
        shares=shares,
        phalanx=phalanx,
        palmar=faces,
        low=ranges[..., 0],
        high=ranges[..., 1],
        palm=torch.stack([_palm_points(body, side) for side in range(2)]),
    )


def _palm_points(body: BodyModel, side: int) -> Float[Tensor, "palmpoints 3"]:
    """Return points on the skin from the heel of the hand to the knuckles, from the wrist."""
    hand, places = hand_skins(body)[side], body.vertices - body.rest_joints[WRISTS[side]]
    return places[_spread(places, hand.vertices[hand.finger == PALM], _PALM_POINTS)]


def _points(
    body: BodyModel, side: int, hand: HandSkin, palmar: Float[Tensor, "2 5 3"]
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Return points of the skin of five fingers, shares of their bones, phalanges, and whether palmar."""
    normals = vertex_normals(body.vertices, body.faces)
    places = body.vertices - body.rest_joints[WRISTS[side]]
    chosen = torch.stack(
        [
            torch.cat(
                [
                    _spread(places, hand.vertices[(hand.finger == f) & (hand.phalanx == k)])
                    for k in range(3)
                ]
            )
            for f in range(5)
        ]
    )
    bones = torch.arange(22 + 15 * side, 37 + 15 * side).view(5, 1, 3, 1)
    own = (body.skin_joints[chosen][:, :, None] == bones) * body.skin_weights[chosen][:, :, None]
    own = own.sum(dim=-1)
    shares = torch.cat([1 - own.sum(dim=-1, keepdim=True), own], dim=-1)
    faces = (normals[chosen] * palmar[side][:, None]).sum(dim=-1) > HAND_SKIN.palmar_cosine
    phalanx = torch.arange(3).repeat_interleave(PER_PHALANX).expand(5, -1)
    return places[chosen], shares, phalanx, faces


def _spread(
    places: Float[Tensor, "all 3"], among: Int[Tensor, " some"], count: int = PER_PHALANX
) -> Int[Tensor, " chosen"]:
    """Return vertices that are far from each other: each is the farthest from those before it."""
    own = places[among]
    chosen = [int((own - own.mean(dim=0)).norm(dim=1).argmax())]
    far = (own - own[chosen[0]]).norm(dim=1)
    while len(chosen) < count:
        chosen.append(int(far.argmax()))
        far = torch.minimum(far, (own - own[chosen[-1]]).norm(dim=1))
    return among[chosen]
