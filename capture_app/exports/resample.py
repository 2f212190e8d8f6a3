"""A motion at another frame rate, by time: hands stay on the object and planted feet stand still."""

from dataclasses import dataclass, fields, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.geometry.transforms import to_local
from omomo_core.long_arrays import let_go
from omomo_core.motion import FPS, HumanMotion, ObjectMotion
from omomo_core.skeleton import joint

LEGS: tuple[LimbName, LimbName] = ("left_leg", "right_leg")
ARMS: tuple[LimbName, LimbName] = ("left_arm", "right_arm")
ANKLES = (joint("left_ankle"), joint("right_ankle"))
TOES = (joint("left_foot"), joint("right_foot"))
_END: dict[LimbName, int] = {"left_leg": 7, "right_leg": 8, "left_arm": 22, "right_arm": 23}
_CLOSE = 1e-5
"""Metres: limbs that end so near to where they should are left alone."""


@dataclass(frozen=True)
class Sampled:
    """A motion and its object at the rate of a file, not at that of the core."""

    human: HumanMotion
    """A contact is 1 only where it lasts from the frame before to the frame after."""
    object_motion: ObjectMotion
    fps: float


def frames_of(
    human: HumanMotion, object_motion: ObjectMotion, some: slice
) -> tuple[HumanMotion, ObjectMotion]:
    """Return some frames of a motion and its object; none of those read from a file stays in memory."""
    arrays = {f.name: getattr(human, f.name) for f in fields(HumanMotion)}
    part = HumanMotion(**{name: array[some].copy() for name, array in arrays.items()})
    for array in arrays.values():
        let_go(array)
    T, valid = object_motion.T_world_object[some], object_motion.valid[some]
    return part, replace(object_motion, T_world_object=T, valid=valid)


@dataclass(frozen=True)
class _Clock:
    """Output times between the frames around them."""

    source: Float[np.ndarray, " frames"]
    wanted: Float[np.ndarray, " times"]
    before: Int[np.ndarray, " times"]
    after: Int[np.ndarray, " times"]

    def points(self, x: Float[np.ndarray, "frames *n 3"]) -> Float[np.ndarray, "times *n 3"]:
        """Along a cubic that does not overshoot: what stands, stands."""
        return PchipInterpolator(self.source, x, axis=0)(self.wanted)

    def rotations(
        self, R: Float[np.ndarray, "frames joints 3 3"]
    ) -> Float[np.ndarray, "times joints 3 3"]:
        """Along the shortest arc."""
        start, end = R[self.before].reshape(-1, 3, 3), R[self.after].reshape(-1, 3, 3)
        share = np.repeat(self.wanted * FPS - self.before, R.shape[1])
        first = Rotation.from_matrix(start)
        way = (first.inv() * Rotation.from_matrix(end)).as_rotvec()
        turned = first * Rotation.from_rotvec(share[:, None] * way)
        return turned.as_matrix().reshape(-1, *R.shape[1:])

    def lasting(self, mask: Bool[np.ndarray, "frames n"]) -> Bool[np.ndarray, "times n"]:
        """Return the mask of times at which something holds both before and after."""
        return mask[self.before] & mask[self.after]


def at_rate(
    human: HumanMotion, object_motion: ObjectMotion, body: BodyModel, fps: float
) -> Sampled:
    """Resample from 30 frames a second.

    Between two frames a bent leg's ankle is not where the ankle stood in both, and a palm leaves what
    it holds: legs and arms are solved anew onto the resampled ankles, toes and palms.

    Args:
        human: at 30 fps.
        object_motion: as many frames.
        body: whose bones the motion moves.
        fps: frames a second; the last one is at or before the last of the source.
    """
    if fps == FPS or len(human.root) < 2:
        return Sampled(human, object_motion, fps)
    clock = _clock(len(human.root), fps)
    T = _object_poses(clock, object_motion.T_world_object)
    root, turned = clock.points(human.root), clock.rotations(human.rotations)
    for side in range(2):
        ankle = _ankle(clock, human, body, turned, side)
        turned = solved(body, root, turned, LEGS[side], ankle)
        palm = _palm(clock, human, object_motion, T, side)
        turned = solved(body, root, turned, ARMS[side], palm)
    posed = HumanMotion(
        root=root.astype(np.float32),
        rotations=turned.astype(np.float32),
        fingers=clock.rotations(human.fingers).astype(np.float32),
        joints=joints_of(body, root, turned).astype(np.float32),
        hand_contact=clock.lasting(human.hand_contact > 0.5).astype(np.float32),
        foot_contact=clock.lasting(human.foot_contact > 0.5).astype(np.float32),
    )
    valid = clock.lasting(object_motion.valid[:, None])[:, 0]
    return Sampled(posed, replace(object_motion, T_world_object=T, valid=valid), fps)


def _clock(frames: int, fps: float) -> _Clock:
    source = np.arange(frames) / FPS
    times = np.arange(np.floor(source[-1] * fps + 1e-6) + 1) / fps
    at = np.clip(times * FPS, 0.0, frames - 1)
    at = np.where(np.abs(at - np.round(at)) < 1e-6, np.round(at), at)
    before, after = np.floor(at).astype(int), np.ceil(at).astype(int)
    return _Clock(source, at / FPS, before, after)


def _object_poses(
    clock: _Clock, T: Float[np.ndarray, "frames 4 4"]
) -> Float[np.ndarray, "times 4 4"]:
    out = np.tile(np.eye(4), (len(clock.wanted), 1, 1))
    out[:, :3, :3] = clock.rotations(T[:, None, :3, :3])[:, 0]
    out[:, :3, 3] = clock.points(T[:, :3, 3])
    return out


def _ankle(
    clock: _Clock,
    human: HumanMotion,
    body: BodyModel,
    R: Float[np.ndarray, "times 22 3 3"],
    side: int,
) -> Float[np.ndarray, "times 3"]:
    """Return the ankle's positions; a foot that rolls over its toes is led by these."""
    heel, toe = human.foot_contact[:, side] > 0.5, human.foot_contact[:, 2 + side] > 0.5
    lasting = clock.lasting(np.stack([heel, toe], axis=1))
    rolls = lasting[:, 1] & ~lasting[:, 0]
    ankle, ball = (clock.points(human.joints[:, j[side]]) for j in (ANKLES, TOES))
    rest = body.rest_joints.double().numpy()
    bone = R[:, ANKLES[side]] @ (rest[TOES[side]] - rest[ANKLES[side]])
    return np.where(rolls[:, None], ball - bone, ankle)


def _palm(
    clock: _Clock,
    human: HumanMotion,
    object_motion: ObjectMotion,
    T: Float[np.ndarray, "times 4 4"],
    side: int,
) -> Float[np.ndarray, "times 3"]:
    """Return the palm's positions: fixed in the object's frame while it holds, else in the world."""
    palm = human.joints[:, 22 + side].astype(np.float64)
    on_object = clock.points(to_local(object_motion.T_world_object, palm[:, None])[:, 0])
    carried = np.einsum("txy,ty->tx", T[:, :3, :3], on_object) + T[:, :3, 3]
    holds = clock.lasting(human.hand_contact[:, side, None] > 0.5)
    return np.where(holds, carried, clock.points(palm))


def solved(
    body: BodyModel,
    root: Float[np.ndarray, "times 3"],
    R: Float[np.ndarray, "times 22 3 3"],
    limb: LimbName,
    target: Float[np.ndarray, "times 3"],
    weight: Float[np.ndarray, " times"] | None = None,
) -> Float[np.ndarray, "times 22 3 3"]:
    """Put a palm or an ankle where it belongs; where it is already there, nothing changes.

    Args:
        body: whose bones.
        root: pelvis, world, metres.
        R: global rotations of the body joints.
        limb: which arm or leg.
        target: palm or ankle, world, metres.
        weight: from 0 (as it was) to 1 (solved), the default.
    """
    off = np.linalg.norm(joints_of(body, root, R)[:, _END[limb]] - target, axis=1) > _CLOSE
    blend = None if weight is None else torch.from_numpy(weight.copy())
    pelvis, turns, goal = (torch.from_numpy(x) for x in (root, R, target))
    new, _ = reach(body, pelvis, turns, limb, goal, weight=blend)
    return np.where(off[:, None, None, None], new.numpy(), R)
