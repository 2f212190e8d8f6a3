"""Where the prop goes: at rest, taken, carried in front of the moving body, put down."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.model import BodyModel
from omomo_core.data.retarget import joints_of
from omomo_core.data.synthesis.footage import heading
from omomo_core.data.synthesis.script import Script
from omomo_core.data.synthesis.stage import Stage
from omomo_core.skeleton import joint

Path6 = Float[np.ndarray, "frames 6"]
"""x, y, z of the prop's origin, yaw, pitch, roll about the palms' middle."""

_SIDE_DISTANCE = (0.17, 0.22)
"""From the middle of the body to the near side of a thing carried beside the leg, metres."""
_CLEARANCE: dict[str, float] = {
    "pelvis": 0.14,
    "spine2": 0.14,
    "spine3": 0.14,
    "neck": 0.09,
    "head": 0.13,
    "left_hip": 0.11,
    "right_hip": 0.11,
    "left_knee": 0.07,
    "right_knee": 0.07,
    "left_ankle": 0.06,
    "right_ankle": 0.06,
    "left_foot": 0.09,
    "right_foot": 0.09,
}
"""Flesh in front of the joints, metres."""


@dataclass(frozen=True)
class Handling:
    """The prop's motion and when it is in the hands."""

    T_world_prop: Float[np.ndarray, "frames 4 4"]
    first: int
    """First frame of contact."""
    last: int
    """One past the last frame of contact."""


def direct(rng: np.random.Generator, body: BodyModel, stage: Stage, script: Script) -> Handling:
    """Let the prop follow the script and the actor's base motion."""
    frames = len(stage.root)
    first, last = script.contact_frames(stage.pauses, frames)
    joints = joints_of(body, stage.root, stage.rotations)
    sigma = rng.uniform(6.0, 12.0)
    xy = gaussian_filter1d(stage.root[:, :2], sigma, axis=0, mode="nearest")
    yaw = gaussian_filter1d(heading(stage.rotations), sigma * 1.2, mode="nearest")
    side = _side(rng, script)

    def beside(rows: slice, moment: int, height: float) -> Path6:
        """The pose relative to the body at three moments: 0 taken, 1 carried, 2 left."""
        near = _near_distance(stage, joints, yaw, script, rows, moment, height)
        angle = yaw[rows] + script.swings[moment]
        ahead = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)
        at = xy[rows] + near * ahead + side * left
        out = np.zeros((len(at), 6))
        out[:, :2], out[:, 2], out[:, 3] = at, height, angle + script.turns[moment]
        return out

    carried = beside(slice(None), 1, script.hold_height) + _sway(rng, stage, script)
    path = carried
    if script.takes:
        start = beside(slice(first, first + 1), 0, script.rest_heights[0])
        path = _towards(start, path, (np.arange(frames) - first - 2) / script.lift)
    if script.leaves:
        end = beside(slice(last - 1, last), 2, script.rest_heights[1])
        path = _towards(end, path, (last - 3 - np.arange(frames)) / script.lower)
    return Handling(_poses(path, script), first, last)


def _near_distance(
    stage: Stage,
    joints: Float[np.ndarray, "frames 24 3"],
    yaw: Float[np.ndarray, " frames"],
    script: Script,
    rows: slice,
    moment: int,
    height: float,
) -> float:
    """How far ahead the prop's origin is such that it does not touch the body."""
    if not all(script.hands):
        return 0.12 if moment != 1 else 0.02
    low, high = script.prop.low, script.prop.high
    angle = yaw[rows] + script.swings[moment]
    needed = [script.distance]
    for name, flesh in _CLEARANCE.items():
        offset = joints[rows, joint(name)] - stage.root[rows]
        ahead = offset[:, 0] * np.cos(angle) + offset[:, 1] * np.sin(angle) + flesh
        aside = offset[:, 1] * np.cos(angle) - offset[:, 0] * np.sin(angle)
        z = joints[rows, joint(name), 2]
        meets = (z > height + low[2] - 0.06) & (z < height + high[2] + 0.06)
        meets &= (aside > low[1] - 0.08) & (aside < high[1] + 0.08)
        if meets.any():
            needed.append(float(np.quantile(ahead[meets], 0.95)) + 0.02)
    return max(needed) - float(low[0])


def _side(rng: np.random.Generator, script: Script) -> float:
    """Sideways offset: a thing in one hand hangs beside the leg."""
    if all(script.hands):
        return rng.normal(0.0, 0.02)
    outward = 1.0 if script.hands[0] else -1.0
    return outward * (rng.uniform(*_SIDE_DISTANCE) + float(script.prop.high[1]))


def _sway(rng: np.random.Generator, stage: Stage, script: Script) -> Path6:
    """What arms do to a carried thing: it bobs with the steps, drifts and rocks a little."""
    frames = len(stage.root)
    noise = gaussian_filter1d(rng.normal(size=(frames + 80, 6)), rng.uniform(8, 16), axis=0)
    noise = noise[40:-40] / max(float(noise.std()), 1e-9)
    scale = np.array([0.012, 0.012, 0.01, 0.03, 0.025, 0.02])
    if script.on_floor:
        scale = np.array([0.006, 0.006, 0.0, 0.02, 0.0, 0.0])
    sway = noise * scale * rng.uniform(0.3, 1.3)
    if not script.on_floor:
        z = stage.root[:, 2]
        bob = gaussian_filter1d(z, 1.5) - gaussian_filter1d(z, 15.0)
        sway[:, 2] += rng.uniform(0.4, 0.9) * np.roll(bob, int(rng.integers(0, 3)))
        sway[:, 2] = sway[:, 2].clip(-script.hold_height + 0.02)
        sway[:, 4] += script.tilt
    if script.action == "in_place":
        sway[:, 3:5] += _gestures(rng, frames)
    return sway


def _gestures(rng: np.random.Generator, frames: int) -> Float[np.ndarray, "frames 2"]:
    """Turning and tilting a thing in the hands to look at it: slow yaw and pitch."""
    swing = gaussian_filter1d(rng.normal(size=(frames + 120, 2)), rng.uniform(12, 22), axis=0)
    swing = swing[60:-60] / max(float(np.abs(swing).max()), 1e-9)
    return swing * np.array([rng.uniform(0.1, 0.5), rng.uniform(0.0, 0.6)])


def _towards(
    rest: Float[np.ndarray, "1 6"], path: Path6, progress: Float[np.ndarray, " frames"]
) -> Path6:
    """`rest` where progress is below 0, `path` where it is above 1: up first, then closer."""
    up = min_jerk(progress / 0.85)[:, None]
    along = min_jerk((progress - 0.2) / 0.8)[:, None]
    weight = np.concatenate([along, along, up, along, along, along], axis=1)
    return rest + weight * (path - rest)


def min_jerk(u: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """0 to 1 with no speed and no acceleration at both ends."""
    u = np.clip(u, 0.0, 1.0)
    return u**3 * (10.0 - 15.0 * u + 6.0 * u**2)


def _poses(path: Path6, script: Script) -> Float[np.ndarray, "frames 4 4"]:
    turned = Rotation.from_euler("ZYX", path[:, 3:6]).as_matrix()
    upright = Rotation.from_euler("Z", path[:, 3:4]).as_matrix()
    used = script.grasp.points[list(script.hands)]
    pivot = used.mean(axis=0)
    poses = np.tile(np.eye(4), (len(path), 1, 1))
    poses[:, :3, :3] = turned
    poses[:, :3, 3] = path[:, :3] + (upright - turned) @ pivot
    return poses
