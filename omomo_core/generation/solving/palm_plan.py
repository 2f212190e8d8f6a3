"""Palm plan: how each hand lies on what it holds, one smooth path of orientations for each contact.

Orientations are tried in the object's frame: headings about the surface's normal, and lifts of the wrist.
The cheapest path through them keeps the wrist within its range and the forearm out of the object, suits
the grip of the fingers, and turns slowly.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import roma
import torch
from jaxtyping import Float, Int
from scipy.ndimage import gaussian_filter1d
from torch import Tensor
from torch.nn.functional import normalize

from omomo_core.body.finger_model import finger_model
from omomo_core.body.grip import HandPoses, grip_worth
from omomo_core.body.kinematics import WRISTS
from omomo_core.body.limbs import forearm_towards
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.config import JOINT_RANGES
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.collision.root import ELBOWS, SHOULDERS
from omomo_core.generation.solving.config import PALM_PLAN
from omomo_core.geometry.cheapest_path import cheapest_path
from omomo_core.geometry.distance_field import DistanceField
from omomo_core.geometry.easing import min_jerk
from omomo_core.skeleton import PALM_JOINTS

_RANGES = torch.tensor([JOINT_RANGES.left_wrist, JOINT_RANGES.right_wrist])
"""Of the left and the right wrist: least and greatest component about each axis, radians."""


@dataclass(frozen=True)
class HeldPalm:
    """One hand's contact with the poses of arm and object in its key frames."""

    side: int
    start: int
    stop: int
    keys: Int[np.ndarray, " keys"]
    anchor: Float[Tensor, "3"]
    """Of the palm, object's frame, metres."""
    out: Float[Tensor, "3"]
    """The surface's normal there, object's frame."""
    shoulder: Float[Tensor, "keys 3"]
    """Object's frame."""
    R_upper: Float[Tensor, "keys 3 3"]
    """Rotations in the object's frame."""
    R_fore: Float[Tensor, "keys 3 3"]
    R_wrist: Float[Tensor, "keys 3 3"]
    free: Float[Tensor, " keys"]
    """How far each key frame may be changed, from 0 to 1."""

    def away(self, frames: int) -> Int[np.ndarray, " frames"]:
        """Return how many frames before or after the contact each frame is; 0 in it."""
        t = np.arange(frames)
        return np.maximum(np.maximum(self.start - t, t - self.stop + 1), 0)


@dataclass(frozen=True)
class _Choices:
    """Orientations that are tried in one contact: rotations in the object's frame."""

    values: Float[Tensor, "choices 2"]
    """Heading and lift."""
    R: Float[Tensor, "choices 3 3"]
    wrists: Float[Tensor, "choices 3"]
    loss: Float[Tensor, " choices"]
    """Cost of a grip that is worth less than the best one, and of a palm that rises."""


def turn_palms(
    body: BodyModel,
    wrists: Float[Tensor, "frames 2 3 3"],
    holds: Sequence[HeldPalm],
    T_world_object: Float[np.ndarray, "frames 4 4"],
    field: DistanceField,
) -> Float[Tensor, "frames 2 3"]:
    """Return how both hands turn so that they lie on what they hold: rotation vectors, world axes.

    Args:
        body: whose hands.
        wrists: global R_world_wrist, palms on their anchors.
        holds: the contacts.
        T_world_object: the object's pose.
        field: signed distance to the object.
    """
    turn = torch.zeros(*wrists.shape[:2], 3)
    total = torch.full(wrists.shape[:2], 1e-6)
    R_world_object = torch.from_numpy(T_world_object[:, :3, :3]).float()
    for hold in holds:
        own = slice(hold.start, hold.stop)
        R = R_world_object[own] @ _path(body, hold, field)
        step = roma.rotmat_to_rotvec(R @ wrists[own, hold.side].mT)
        share, nearest = _around(hold, len(wrists))
        turn[:, hold.side] += share[:, None] * step[nearest]
        total[:, hold.side] += share
    return turn / total.clamp(min=1.0)[..., None]


def find_holds(
    joints: Float[Tensor, "frames 24 3"],
    rotations: Float[Tensor, "frames 22 3 3"],
    segments: Sequence[ContactSegment],
    T_world_object: Float[np.ndarray, "frames 4 4"],
    field: DistanceField,
    free: Float[Tensor, " frames"],
) -> Iterator[HeldPalm]:
    """Yield one person's contacts.

    Args:
        joints: of the model, world, metres.
        rotations: global R_world_joint.
        segments: what each hand holds and when.
        T_world_object: the object's pose.
        field: signed distance to the object.
        free: how far each frame may be changed, from 0 to 1.
    """
    T = torch.from_numpy(T_world_object).float()
    for s in segments:
        start, stop = max(s.start, 0), min(s.stop, len(T))
        if start >= stop:
            continue
        keys = np.unique(np.append(np.arange(start, stop, PALM_PLAN.stride), stop - 1))
        anchor = torch.from_numpy(s.anchor).float()
        out = field.exact(anchor[None])[1][0]
        to_object = T[keys, :3, :3].mT
        upper, fore, wrist = (
            to_object @ rotations[keys, of[s.hand]] for of in (SHOULDERS, ELBOWS, WRISTS)
        )
        shift = joints[keys, SHOULDERS[s.hand]] - T[keys, :3, 3]
        shoulder = (to_object @ shift[..., None])[..., 0]
        yield HeldPalm(
            s.hand, start, stop, keys, anchor, out, shoulder, upper, fore, wrist, free[keys]
        )


def _around(hold: HeldPalm, frames: int) -> tuple[Float[Tensor, " frames"], Int[Tensor, " frames"]]:
    """Return how far a hold's plan counts in each frame, and the nearest frame of the hold."""
    share = torch.from_numpy(min_jerk(1 - hold.away(frames) / PALM_PLAN.ease)).float()
    nearest = np.clip(np.arange(frames), hold.start, hold.stop - 1) - hold.start
    return share, torch.from_numpy(nearest)


def _path(body: BodyModel, hold: HeldPalm, field: DistanceField) -> Float[Tensor, "frames 3 3"]:
    """Return the hand's rotation in the object's frame in each frame of a hold."""
    base = _base(hold)
    choices = _choices(body, hold, base, field)
    cost = _costs(body, hold, choices, field)
    apart = choices.values[:, None] - choices.values
    change = PALM_PLAN.change * apart.square().sum(dim=-1)
    change = change + PALM_PLAN.leap * (apart.abs().amax(dim=-1) > PALM_PLAN.farthest_step)
    chosen = cheapest_path(cost[None], change)[0]
    frames = np.arange(hold.start, hold.stop)
    path = np.stack([np.interp(frames, hold.keys, x) for x in choices.values[chosen].T.numpy()], 1)
    path = gaussian_filter1d(path, PALM_PLAN.smoothing, axis=0, mode="nearest")
    return _oriented(base, hold, torch.from_numpy(path).float())


def _base(hold: HeldPalm) -> Float[Tensor, "3 3"]:
    """Return the hand laid flat in its mean heading, object's frame."""
    along = hold.R_wrist[:, :, 0].mean(dim=0)
    along = along - (along @ hold.out) * hold.out
    if along.norm() < PALM_PLAN.least_heading:
        along = torch.linalg.cross(hold.out, hold.R_wrist[:, :, 2].mean(dim=0))
    along = normalize(along, dim=0)
    return torch.stack([along, hold.out, torch.linalg.cross(along, hold.out)], dim=1)


def _oriented(
    base: Float[Tensor, "3 3"], hold: HeldPalm, values: Float[Tensor, "some 2"]
) -> Float[Tensor, "some 3 3"]:
    """Return hands turned about the surface's normal, then with the wrist lifted from the surface."""
    about = roma.rotvec_to_rotmat(values[:, :1] * hold.out)
    lift = values[:, 1:] * torch.tensor([0.0, 0.0, 2.0 * hold.side - 1.0])
    return about @ base @ roma.rotvec_to_rotmat(lift)


def _choices(
    body: BodyModel, hold: HeldPalm, base: Float[Tensor, "3 3"], field: DistanceField
) -> _Choices:
    values = torch.cartesian_prod(
        torch.linspace(-PALM_PLAN.heading, PALM_PLAN.heading, PALM_PLAN.headings),
        torch.tensor(PALM_PLAN.lifts),
    )
    R, rest = _oriented(base, hold, values), body.rest_joints.float()
    wrists = hold.anchor - R @ (rest[PALM_JOINTS[hold.side]] - rest[WRISTS[hold.side]])
    side = torch.full((len(R),), hold.side)
    skin = HandPoses(R, wrists, side).placed(finger_model(body).palm[side])
    rise = (-field.at(skin).amin(dim=-1)).clamp(0.0, PALM_PLAN.highest)
    wrists = wrists + rise[:, None] * hold.out
    worth = grip_worth(body, HandPoses(R, wrists, side), field)
    loss = PALM_PLAN.grip * (worth.max() - worth) + PALM_PLAN.rise_cost * rise
    return _Choices(values, R, wrists, loss)


def _costs(
    body: BodyModel, hold: HeldPalm, choices: _Choices, field: DistanceField
) -> Float[Tensor, "keys choices"]:
    """Return the cost of each orientation in each key frame."""
    ways = choices.wrists - hold.shoulder[:, None]
    upper, fore = (
        x[:, None].expand(-1, len(choices.R), -1, -1) for x in (hold.R_upper, hold.R_fore)
    )
    R_fore = forearm_towards(body, hold.side, upper, fore, ways)
    R = choices.R.expand(len(ways), -1, -1, -1)
    excess = beyond_range(hold.side, R_fore @ share_twist(R_fore, R), R)
    rest = body.rest_joints
    shoulder, elbow, wrist = (of[hold.side] for of in (SHOULDERS, ELBOWS, WRISTS))
    bone = (rest[wrist] - rest[elbow]).float()
    length = (rest[elbow] - rest[shoulder]).norm() + bone.norm()
    far = (ways.norm(dim=-1) - PALM_PLAN.stretch * length).clamp(min=0.0)
    along = torch.tensor(PALM_PLAN.forearm_places)[:, None]
    flesh = choices.wrists[:, None] - along * (R_fore @ bone)[..., None, :]
    depth = (torch.tensor(PALM_PLAN.forearm_radii) - field.at(flesh)).clamp(min=0.0)
    turned = roma.rotmat_geodesic_distance(hold.R_wrist[:, None], choices.R)
    kept = PALM_PLAN.closeness + PALM_PLAN.fixed * (hold.free[:, None] < 0.5)
    return (
        PALM_PLAN.range * excess.sum(dim=-1)
        + PALM_PLAN.reach * far.square()
        + PALM_PLAN.penetration * depth.square().sum(dim=-1)
        + kept * turned.square()
        + choices.loss
        + PALM_PLAN.heading_cost * choices.values[:, 0].square()
        + PALM_PLAN.lift_cost * choices.values[:, 1].square()
    )


def beyond_range(
    side: int, R_fore: Float[Tensor, "*b 3 3"], R_wrist: Float[Tensor, "*b 3 3"]
) -> Float[Tensor, "*b 3"]:
    """Return how far a wrist is beyond its range less a spare, about each axis, radians."""
    bend = roma.rotmat_to_rotvec(R_fore.mT @ R_wrist)
    low, high = _RANGES[side, :, 0] + PALM_PLAN.spare, _RANGES[side, :, 1] - PALM_PLAN.spare
    return (bend - high.to(bend)).clamp(min=0.0) + (low.to(bend) - bend).clamp(min=0.0)


def share_twist(
    R_fore: Float[Tensor, "*b 3 3"], R_wrist: Float[Tensor, "*b 3 3"]
) -> Float[Tensor, "*b 3 3"]:
    """Return the turns of forearms about their own axis that take a part of their wrists' twist."""
    q = roma.rotmat_to_unitquat(R_fore.mT @ R_wrist)
    twist = 2 * torch.atan2(q[..., 0], q[..., 3])
    # The sine has no jump where a hand is turned round altogether.
    along = torch.tensor([1.0, 0.0, 0.0]).to(R_fore)
    return roma.rotvec_to_rotmat(PALM_PLAN.twist * twist.sin()[..., None] * along)
