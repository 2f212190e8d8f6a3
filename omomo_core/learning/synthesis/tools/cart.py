"""A cart pushed by its handle: it rolls ahead on the path that the actor will walk."""

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.actor_path import ActorPath, actor_path
from omomo_core.learning.synthesis.base_motion import BaseMotion
from omomo_core.learning.synthesis.holds import Handling
from omomo_core.learning.synthesis.tools.grip import ToolBar, grip_holds
from omomo_core.learning.synthesis.tools.tool_use import ToolUse

_GRIP = 0.012
_STRAIGHT = 0.85
_THUMBS = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
"""Toward each other."""
_STEP, _SMOOTH = 0.02, 0.22
"""Of the path, metres."""
_NEAR, _FAR, _ASIDE = 0.27, 0.68, 0.24
"""Where the handle may be before the pelvis, metres."""


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
    if not _in_reach(path, span, points + (handle - axle) * directions):
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


def _in_reach(
    path: ActorPath, span: tuple[int, int], handle: Float[np.ndarray, "frames 2"]
) -> bool:
    rows = slice(*span)
    offset = handle - path.xy[rows]
    ahead = (offset * path.ahead[rows]).sum(-1)
    aside = (offset * path.left[rows]).sum(-1)
    return bool(ahead.min() > _NEAR and ahead.max() < _FAR and np.abs(aside).max() < _ASIDE)
