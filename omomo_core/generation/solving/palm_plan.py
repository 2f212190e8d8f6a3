"""The plan of the palms: where they hold, how they come there, within reach and clear of the object.

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
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor
from torch.nn.functional import normalize

from omomo_core.body.finger_model import finger_model, pose_fingers
from omomo_core.body.grip import HandPoses, grip_worth, relaxed_angles
from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.limbs import LimbName, forearm_towards, reach
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets
from omomo_core.body.trajectory_optimization.solver_config import JOINT_RANGES
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.collision.avoidance import ELBOWS, SHOULDERS
from omomo_core.generation.solving.foot_plan import FootPlan
from omomo_core.generation.solving.solving_config import PALM_CLEARANCE, PALM_PLAN, REACH
from omomo_core.geometry.cheapest_path import cheapest_path
from omomo_core.geometry.distance_field import DistanceField
from omomo_core.geometry.runs import min_jerk
from omomo_core.skeleton import PALM_JOINTS

_RANGES = torch.tensor([JOINT_RANGES.left_wrist, JOINT_RANGES.right_wrist])
"""Ranges of the left and the right wrist: least and greatest component about each axis, radians."""


@dataclass(frozen=True)
class HeldPalm:
    """One hand's contact with the poses of arm and object in its key frames."""

    side: int
    start: int
    stop: int
    keys: Int[np.ndarray, " keys"]
    anchor: Float[Tensor, "3"]
    """Anchor of the palm, object's frame, metres."""
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
    """Return the hand laid flat in its mean heading, or in that of fixed frames; object's frame."""
    fixed = hold.free < 0.5
    R = hold.R_wrist[fixed] if fixed.any() else hold.R_wrist
    along = R[:, :, 0].mean(dim=0)
    along = along - (along @ hold.out) * hold.out
    if along.norm() < PALM_PLAN.least_heading:
        along = torch.linalg.cross(hold.out, R[:, :, 2].mean(dim=0))
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


def raise_palms(
    body: BodyModel,
    wrists: Float[Tensor, "frames 2 3"],
    R_world_wrist: Float[Tensor, "frames 2 3 3"],
    holds: Sequence[HeldPalm],
    T_world_object: Float[np.ndarray, "frames 4 4"],
    field: DistanceField,
) -> Float[Tensor, "frames 2 3"]:
    """Return how far hands move so that their skin is out of what they hold; world, metres.

    Palms are measured where they hold; before and after, the fingers of a relaxed hand are, too.

    Args:
        body: whose hands.
        wrists: world, metres.
        R_world_wrist: of the hands as they lie on what they hold.
        holds: their contacts.
        T_world_object: the object's pose.
        field: signed distance to the object.
    """
    shift, total = torch.zeros_like(wrists), torch.full(wrists.shape[:2], 1e-6)
    T = torch.from_numpy(T_world_object).float()
    for hold in holds:
        share = _share(hold, len(T))
        keys = _keys(share.numpy())
        to_object = T[keys, :3, :3].mT
        at = (to_object @ (wrists[keys, hold.side] - T[keys, :3, 3])[..., None])[..., 0]
        side = torch.full((len(keys),), hold.side)
        poses = HandPoses(to_object @ R_world_wrist[keys, hold.side], at, side)
        up = _landed(hold, keys, _needed(body, hold, keys, poses, field), len(T))
        shift[:, hold.side] += (share * up)[:, None] * (T[:, :3, :3] @ hold.out)
        total[:, hold.side] += share
    return shift / total.clamp(min=1.0)[..., None]


def _share(hold: HeldPalm, frames: int) -> Float[Tensor, " frames"]:
    """Return how far a hand is kept out of the object in each frame: it may pass through it elsewhere."""
    rest = PALM_CLEARANCE.reach - hold.away(frames)
    return torch.from_numpy(min_jerk(rest / PALM_CLEARANCE.fade)).float()


def _keys(share: Float[np.ndarray, " frames"]) -> Int[np.ndarray, " keys"]:
    """Return the frames that are measured: some of those in which a hold counts."""
    first, last = np.flatnonzero(share)[[0, -1]]
    return np.unique(np.append(np.arange(first, last, PALM_CLEARANCE.stride), last))


def _needed(
    body: BodyModel,
    hold: HeldPalm,
    keys: Int[np.ndarray, " keys"],
    poses: HandPoses,
    field: DistanceField,
) -> Float[np.ndarray, " keys"]:
    """Return how far a hand must go along the normal to be outside, metres."""
    model, needed = finger_model(body), torch.zeros(len(keys))
    side = torch.tensor([hold.side])
    fingers = pose_fingers(model, side, relaxed_angles()[None]).points[0].flatten(0, 1)
    whole = torch.cat([model.palm[hold.side], fingers])
    holding = torch.from_numpy((keys >= hold.start) & (keys < hold.stop))
    for some, skin in ((holding, model.palm[hold.side]), (~holding, whole)):
        own = poses[some]
        points = own.placed(skin.expand(len(own.side), -1, -1))
        needed[some] = _outside(points, hold.out, field)
    return needed.numpy()


def _landed(
    hold: HeldPalm,
    keys: Int[np.ndarray, " keys"],
    needed: Float[np.ndarray, " keys"],
    frames: int,
) -> Float[Tensor, " frames"]:
    """Return the rise of every frame, smooth; the nearer a contact is, the less a hand is raised."""
    t = np.arange(frames)
    own = (keys >= hold.start) & (keys < hold.stop)
    held, series = np.interp(t, keys[own], needed[own]), np.interp(t, keys, needed)
    away = hold.away(frames)
    most = held + PALM_CLEARANCE.landing * away
    series = np.minimum(np.where(away > 0, np.maximum(series, held), held), most)
    widest = np.minimum(maximum_filter1d(series, PALM_CLEARANCE.window, mode="nearest"), most)
    smooth = gaussian_filter1d(widest, PALM_CLEARANCE.smoothing, mode="nearest")
    return torch.from_numpy(smooth).float()


def _outside(
    skin: Float[Tensor, "keys points 3"], out: Float[Tensor, "3"], field: DistanceField
) -> Float[Tensor, " keys"]:
    """Return how far points must go along a direction until none is inside, metres."""
    rise, inside = torch.zeros(len(skin)), torch.arange(len(skin))
    for _ in range(PALM_CLEARANCE.rounds * (len(skin) > 0)):
        moved = skin[inside] + rise[inside, None, None] * out
        distance = field.at(moved)
        # The deepest point alone counts, and the grid tells which ones may be it.
        deepest = distance.amin(dim=1, keepdim=True)
        close = distance.abs() < PALM_CLEARANCE.exact_range
        close &= distance < deepest + PALM_CLEARANCE.grid_error
        distance[close] = field.exact(moved[close])[0]
        deepest = distance.amin(dim=1)
        rise[inside] += (-deepest).clamp(min=0.0)
        inside = inside[deepest < 0]
    return rise.clamp(max=PALM_CLEARANCE.highest)


ARMS: tuple[LimbName, LimbName] = ("left_arm", "right_arm")


def solve_arms(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    targets: InteractionTargets,
) -> Float[Tensor, "samples frames 22 3 3"]:
    """Return rotations with both arms solved onto the palm targets, weighted by how firmly hands hold.

    Args:
        body: whose arms.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
        targets: what hands hold.
    """
    for side in range(2):
        weight = targets.hold[..., side].contiguous()
        palms = targets.palms[..., side, :]
        rotations, _ = reach(body, root, rotations, ARMS[side], palms, weight=weight, gently=True)
    return rotations


def move_root_within_reach(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    feet: Sequence[FootPlan],
    targets: InteractionTargets,
    free: Float[Tensor, " frames"],
    stretch: float,
) -> Float[Tensor, "samples frames 3"]:
    """Return the pelvis moved to where arms reach what they hold, and legs the floor; world, metres.

    Args:
        body: whose arms and legs.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
        feet: where they stand.
        targets: what hands hold.
        free: how far each frame may be moved, from 0 to 1.
        stretch: share of a straight arm's length that is within reach.
    """

    def nearer(at: Tensor) -> Tensor:
        for _ in range(REACH.rounds):
            towards = _towards(body, at, rotations, targets, stretch) * free[:, None]
            far = towards.norm(dim=-1, keepdim=True)
            # Each sample stops by itself: its result does not depend on the others.
            lacking = far.amax(dim=1, keepdim=True) > REACH.near
            if not lacking.any():
                break
            move = at + towards - root
            limit = REACH.farthest / move.norm(dim=-1, keepdim=True).clamp(min=REACH.farthest)
            at = torch.where(lacking & (far > 0), root + move * limit, at)
        return at

    near = nearer(root)
    drop = _drop(body, near, rotations, feet) * free
    # What the legs need may take from the arms what they had.
    return nearer(near - drop[..., None] * torch.tensor([0.0, 0.0, 1.0]))


def ankles_of(feet: Sequence[FootPlan]) -> Float[Tensor, "samples frames 2 3"]:
    """Return the left and right ankle of each plan, world, metres."""
    return torch.from_numpy(np.stack([f.ankles for f in feet])).float()


def _towards(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    targets: InteractionTargets,
    stretch: float,
) -> Float[Tensor, "samples frames 3"]:
    """Return a smooth move of the pelvis towards palm targets that are out of reach, metres."""
    joints = forward_kinematics(body, root, rotations)
    rest, move = body.rest_joints, torch.zeros_like(root)
    for side in range(2):
        shoulder, elbow, wrist = SHOULDERS[side], ELBOWS[side], WRISTS[side]
        length = (rest[elbow] - rest[shoulder]).norm() + (rest[wrist] - rest[elbow]).norm()
        target = targets.palms[..., side, :] - (joints[..., 22 + side, :] - joints[..., wrist, :])
        way = target - joints[..., shoulder, :]
        distance = way.norm(dim=-1, keepdim=True).clamp(min=1e-6)
        excess = (distance - stretch * length).clamp(min=0) * targets.hold[..., side, None]
        move = move + 0.5 * excess * way / distance
    return torch.from_numpy(
        gaussian_filter1d(move.numpy(), REACH.smoothing, axis=-2, mode="nearest")
    )


def _drop(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    feet: Sequence[FootPlan],
) -> Float[Tensor, "samples frames"]:
    """Return how much lower the pelvis must be for the legs to reach the feet that stand, metres."""
    joints = forward_kinematics(body, root, rotations)
    ankles, standing = ankles_of(feet), torch.from_numpy(np.stack([f.standing for f in feet]))
    rest, drop = body.rest_joints, torch.zeros(root.shape[:2])
    for side, (hip, knee, ankle) in enumerate(((1, 4, 7), (2, 5, 8))):
        length = (rest[knee] - rest[hip]).norm() + (rest[ankle] - rest[knee]).norm()
        way = joints[..., hip, :] - ankles[..., side, :]
        across = way[..., :2].norm(dim=-1)
        height = (
            ((REACH.leg_stretch * length) ** 2 - across**2)
            .clamp(min=REACH.least_height_squared)
            .sqrt()
        )
        drop = torch.maximum(
            drop, (way[..., 2] - height).clamp(0, REACH.lowest) * standing[..., side]
        )
    # The largest need of the neighbourhood, then smoothed: never less than the need itself.
    near = maximum_filter1d(drop.numpy(), REACH.lowering_window, axis=-1, mode="nearest")
    return torch.from_numpy(
        gaussian_filter1d(near, REACH.lowering_smoothing, axis=-1, mode="nearest")
    )
