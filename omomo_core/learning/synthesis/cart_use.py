"""Carts pushed by their handle, and trolley cases pulled behind."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import min_jerk
from omomo_core.learning.synthesis.base_motion import ActorPath, BaseMotion, actor_path
from omomo_core.learning.synthesis.holds import Handling
from omomo_core.learning.synthesis.tool_use import ToolBar, ToolUse, arm_lengths, grip_holds, sole
from omomo_core.skeleton import joint

_GRIP = 0.012
_STRAIGHT = 0.85
_THUMBS = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
"""Toward each other."""
_STEP, _SMOOTH = 0.02, 0.22
"""Step and smoothing length of the path, metres."""
_NEAR, _FAR, _ASIDE = 0.27, 0.68, 0.24
"""Bounds of the handle's place before the pelvis: ahead, and aside, metres."""


def cart_trajectory(
    rng: np.random.Generator, body: BodyModel, base_motion: BaseMotion, tool_use: ToolUse
) -> Handling | None:
    """Let a cart roll ahead of the walking actor, or be pulled along by one who walks backward.

    Returns:
        None where the actor sidesteps, or turns too sharply for the cart.
    """
    path = actor_path(body, base_motion)
    first, last = span = tool_use.span(base_motion.pauses, len(path.xy))
    straight = path.straight(span)
    if abs(straight) < _STRAIGHT:
        return None
    bar = ToolBar(tool_use.grasp.points + tool_use.grasp.inward * _GRIP, _THUMBS)
    handle = float(bar.centres[:, 0].mean())
    axle = float(tool_use.prop.low[0]) + rng.uniform(0.1, 0.3) * float(
        np.ptp([tool_use.prop.low[0], tool_use.prop.high[0]])
    )
    pelvis, ahead = path.xy[first:last], path.ahead[first:last]
    if straight < 0:
        pelvis, ahead = pelvis[::-1], ahead[::-1]
    rolled = _rolled(pelvis, ahead[-1], tool_use.ahead + axle - handle)
    if straight < 0:
        rolled = rolled[0][::-1], rolled[1][::-1]
    points, directions = rolled
    if not _cart_in_reach(path, span, points + (handle - axle) * directions):
        return None
    poses = np.tile(np.eye(4), (len(path.xy), 1, 1))
    poses[first:last, :2, 0] = directions
    poses[first:last, 0, 1], poses[first:last, 1, 1] = -directions[:, 1], directions[:, 0]
    poses[first:last, :2, 3] = points - axle * directions
    poses[:first], poses[last:] = poses[first], poses[last - 1]
    holds = grip_holds(body, path.joints, poses, bar, tool_use.hands, span, tool_use.times)
    return Handling(poses, holds)


def _rolled(
    pelvis: Float[np.ndarray, "frames 2"], onward: Float[np.ndarray, " 2"], lead: float
) -> tuple[Float[np.ndarray, "frames 2"], Float[np.ndarray, "frames 2"]]:
    """Place and direction of an axle that goes the same way, so much farther on."""
    steps = np.linalg.norm(np.diff(pelvis, axis=0), axis=-1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    extended = np.concatenate([pelvis, pelvis[-1:] + 3.0 * onward])
    at = np.concatenate([way, [way[-1] + 3.0]])
    keep = np.concatenate([[True], np.diff(at) > 1e-6])
    s = np.arange(0.0, at[-1], _STEP)
    line = np.stack([np.interp(s, at[keep], extended[keep, a]) for a in (0, 1)], axis=-1)
    line = gaussian_filter1d(line, _SMOOTH / _STEP, axis=0, mode="nearest")
    slope = np.gradient(line, axis=0)
    slope /= np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-9)
    points, directions = (
        np.stack([np.interp(way + lead, s, values[:, a]) for a in (0, 1)], axis=-1)
        for values in (line, slope)
    )
    return points, directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def _cart_in_reach(
    path: ActorPath, span: tuple[int, int], handle: Float[np.ndarray, "frames 2"]
) -> bool:
    rows = slice(*span)
    offset = handle - path.xy[rows]
    ahead = (offset * path.ahead[rows]).sum(-1)
    aside = (offset * path.left[rows]).sum(-1)
    return bool(ahead.min() > _NEAR and ahead.max() < _FAR and np.abs(aside).max() < _ASIDE)


_TILTS = (np.radians(18), np.radians(52))
_REACH, _FARTHEST = 0.9, 1.01
"""Parts of the straight arm: as planned, and at most."""


@dataclass(frozen=True)
class _Case:
    """A case that stands upright and is pulled toward -x, prop frame, metres."""

    vertices: Float[np.ndarray, "verts 3"]
    axle: float
    """x of the edge it is tipped over."""
    bar: ToolBar
    back: float
    """From the axle to the middle of the bar along x: negative when the bar is ahead of it."""
    height: float
    """Height of the bar, metres."""

    def ahead(self, tilt: float) -> float:
        """How far the bar is ahead of the axle."""
        return float(self.height * np.sin(tilt) - self.back * np.cos(tilt))

    def tilt_at(self, height: float) -> float:
        """The tilt that brings the bar down to a height."""
        long, own = np.hypot(self.height, self.back), np.arctan2(self.back, self.height)
        return float(own + np.arccos(np.clip(height / long, -1.0, 1.0)))

    def tilt_for(self, ahead: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """The tilt that brings the bar so far ahead of the axle."""
        long, own = np.hypot(self.height, self.back), np.arctan2(self.back, self.height)
        return own + np.arcsin(np.clip(ahead / long, -1.0, 1.0))


@dataclass(frozen=True)
class _Trail:
    """The path of the case."""

    axle: Float[np.ndarray, "frames 2"]
    """Its middle, world, metres."""
    yaw: Float[np.ndarray, " frames"]
    """Direction of travel, radians."""
    tilt: Float[np.ndarray, " frames"]
    """0 upright, radians."""


def trolley_trajectory(
    rng: np.random.Generator, body: BodyModel, base_motion: BaseMotion, tool_use: ToolUse
) -> Handling | None:
    """Let a case follow the hand of the walking actor.

    Returns:
        None where the actor does not walk ahead, or the arm does not suit the handle.
    """
    path, case = actor_path(body, base_motion), _case(tool_use)
    first, last = span = tool_use.span(base_motion.pauses, len(path.xy))
    if path.straight(span) < _STRAIGHT:
        return None
    hand = _hand(rng, path, tool_use, case)
    behind, rest = rng.uniform(0.08, 0.24), rng.uniform(0.18, 0.28)
    tilt = case.tilt_at(_hand_height(body, path, behind))
    if not _TILTS[0] < tilt < _TILTS[1]:
        return None
    back = rest + (behind - rest) * _strides_away(path, tool_use, span)
    hand = hand - back[:, None] * path.ahead
    trail = _trail(hand, path, case, tilt, tool_use, span)
    if trail is None:
        return None
    poses = _poses(case, trail)
    poses[:first], poses[last:] = poses[first], poses[last - 1]
    if not _trolley_in_reach(body, path, poses[first:last], case, tool_use, span):
        return None
    holds = grip_holds(body, path.joints, poses, case.bar, tool_use.hands, span, tool_use.times)
    return Handling(poses, holds)


def _case(tool_use: ToolUse) -> _Case:
    vertices = np.unique(np.concatenate([p.vertices for p in tool_use.prop.parts]), axis=0)
    centres = tool_use.grasp.points + tool_use.grasp.inward * _GRIP
    middle = centres.mean(axis=0)
    axle = float(sole(tool_use.prop)[:, 0].min())
    back = float(middle[0]) - axle
    # Whoever pulls it looks along -x: the right hand's thumb points to -y.
    thumbs = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    bar = ToolBar(np.stack([middle, middle]), thumbs)
    return _Case(vertices, axle, bar, back, float(middle[2]))


def _hand(
    rng: np.random.Generator, path: ActorPath, tool_use: ToolUse, case: _Case
) -> Float[np.ndarray, "frames 2"]:
    """Beside the hip on the side of the hand, swaying a little."""
    side = 1.0 if tool_use.hands[0] else -1.0
    wide = float(np.ptp(case.vertices[:, 1])) / 2
    aside = side * max(rng.uniform(0.26, 0.34), 0.6 * wide + 0.16)
    sway = 0.15 * gaussian_filter1d(rng.normal(size=len(path.xy)), 18.0)
    return path.xy + (aside + 0.3 * sway)[:, None] * path.left + 0.3 * sway[:, None] * path.ahead


def _hand_height(body: BodyModel, path: ActorPath, behind: float) -> float:
    shoulder = float(
        np.median(path.joints[:, [joint("left_shoulder"), joint("right_shoulder")], 2])
    )
    return shoulder - float(np.sqrt((_REACH * sum(arm_lengths(body))) ** 2 - behind**2 - 0.08**2))


def _trolley_in_reach(
    body: BodyModel,
    path: ActorPath,
    poses: Float[np.ndarray, "held 4 4"],
    case: _Case,
    tool_use: ToolUse,
    span: tuple[int, int],
) -> bool:
    """Return whether the handle is within reach without bending."""
    shoulder = path.joints[
        slice(*span), joint("left_shoulder" if tool_use.hands[0] else "right_shoulder")
    ]
    palm = poses[:, :3, :3] @ case.bar.centres[0] + poses[:, :3, 3]
    far = np.linalg.norm(palm - shoulder, axis=-1) / sum(arm_lengths(body))
    return bool(far.max() < _FARTHEST)


def _strides_away(
    path: ActorPath, tool_use: ToolUse, span: tuple[int, int]
) -> Float[np.ndarray, " frames"]:
    """0 while the case stands upright beside its owner, 1 when the arm trails behind."""
    t = np.arange(len(path.xy))
    out = np.ones(len(t))
    if tool_use.takes:
        out *= min_jerk((t - span[0]) / (tool_use.settle + 20))
    if tool_use.leaves:
        out *= min_jerk((span[1] - 1 - t) / tool_use.settle)
    return out


def _trail(
    hand: Float[np.ndarray, "frames 2"],
    path: ActorPath,
    case: _Case,
    tilt: float,
    tool_use: ToolUse,
    span: tuple[int, int],
) -> _Trail | None:
    """Axle, direction of travel and tilt: the wheels roll where they point."""
    first, last = span
    full, upright = case.ahead(tilt), case.ahead(0.0)
    ahead = path.ahead[first]
    if tool_use.takes:
        gone = np.flatnonzero(np.linalg.norm(hand[first:last] - hand[first], axis=-1) > full)
        if not len(gone):
            return None
        ahead = hand[first + gone[0]] - hand[first]
        ahead = ahead / np.linalg.norm(ahead)
    axle = hand[first] - (upright if tool_use.takes else full) * ahead
    axles, yaws, lengths = np.tile(axle, (len(hand), 1)), np.zeros(len(hand)), np.zeros(len(hand))
    t = np.arange(len(hand))
    put_down = (
        min_jerk((t - last + 1 + tool_use.settle) / max(tool_use.settle - 2, 1)) * tool_use.leaves
    )
    for k in range(first, last):
        wanted = full + put_down[k] * (upright - full)
        apart = hand[k] - axle
        if np.linalg.norm(apart) > 0.75 * full and put_down[k] == 0.0:
            ahead = apart / np.linalg.norm(apart)
        along = float(apart @ ahead)
        if along > wanted or put_down[k] > 0.0:
            axle = axle + (along - wanted) * ahead
            along = wanted
        axles[k], yaws[k], lengths[k] = axle, np.arctan2(ahead[1], ahead[0]), along
    lengths = lengths.clip(min(upright, 0.0))
    return _Trail(axles, np.unwrap(yaws), case.tilt_for(lengths).clip(0.0))


def _poses(case: _Case, trail: _Trail) -> Float[np.ndarray, "frames 4 4"]:
    poses = np.tile(np.eye(4), (len(trail.yaw), 1, 1))
    tilt = gaussian_filter1d(trail.tilt, 2.0, mode="nearest")
    turn = np.stack([trail.yaw + np.pi, -tilt], axis=-1)
    poses[:, :3, :3] = Rotation.from_euler("ZY", turn).as_matrix()
    poses[:, :2, 3] = trail.axle - poses[:, :2, 0] * case.axle
    poses[:, 2, 3] = -(poses[:, None, 2, :3] @ case.vertices.T).min(axis=-1)[:, 0]
    return poses
