"""Sweeping, mopping, vacuuming: the head of a tool strokes the floor, its pole slants to the hands."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.base_motion import BaseMotion
from omomo_core.learning.synthesis.directions import ahead_of, left_of
from omomo_core.learning.synthesis.footage import heading
from omomo_core.learning.synthesis.holds import Handling
from omomo_core.learning.synthesis.tools.grip import ToolBar, arm_lengths, grip_holds
from omomo_core.learning.synthesis.tools.tool_use import ToolUse, sole
from omomo_core.motion import FPS
from omomo_core.skeleton import joint

_SWIVEL = np.radians(14)
"""How far the pole may rise or sink from the slant at which the head lies flat."""
_RISE = (np.radians(36), np.radians(80))
_TRUNK = 0.17
"""Least distance from the end of the pole to the middle of the trunk, metres."""
_LOWEST, _HIGHEST = 0.62, 1.36
"""Metres above the floor; nobody bends lower for a long pole, or holds it before the throat."""
_FARTHEST = 1.25
"""Of a straight arm, from the shoulders of the base motion: the trunk leans and turns for the rest."""
_TRIES = 10
_FASTEST = 0.75
"""Metres per second somebody walks at most while stroking."""
_GRIP = 0.012
_PLAIN = ("mop", "broom")


@dataclass(frozen=True)
class _Tool:
    """A tool that leans toward -x, prop frame, metres."""

    vertices: Float[np.ndarray, "verts 3"]
    sole: Float[np.ndarray, " 3"]
    """Middle of the head on the floor."""
    middle: Float[np.ndarray, " 3"]
    """Of the hands, on the axis."""
    bar: ToolBar
    length: float
    """From the sole to the middle of the hands."""
    side: float
    """Whose hand is the upper one: 1 left, -1 right."""
    slant: float
    """Rise of that line above the floor as the tool is built, radians."""


def stroke_trajectory(
    rng: np.random.Generator, body: BodyModel, base_motion: BaseMotion, tool_use: ToolUse
) -> Handling | None:
    """Let the head of a tool stroke the floor before the actor.

    Returns:
        None where the actor is too fast, or has no room between the hands and the trunk.
    """
    sigma = rng.uniform(7.0, 11.0)
    xy = gaussian_filter1d(base_motion.root[:, :2], sigma, axis=0, mode="nearest")
    yaw = gaussian_filter1d(heading(base_motion.rotations), sigma * 1.2, mode="nearest")
    if np.linalg.norm(np.diff(xy, axis=0), axis=-1).max() * FPS > _FASTEST:
        return None
    tool = _tool(tool_use)
    joints = joints_of(body, base_motion.root, base_motion.rotations)
    swing = _swing(rng, tool_use, len(xy))
    lift = gaussian_filter1d(rng.uniform(0.0, 0.008, len(xy)), 8.0)
    for _ in range(_TRIES):
        place = np.array(
            [tool_use.ahead + rng.uniform(-0.06, 0.14), tool.side * rng.uniform(-0.04, 0.2)]
        )
        poses = _poses(tool, tool_use, xy, yaw, place, swing, lift)
        room = _room(poses, tool, joints) > _TRUNK
        if room and _in_reach(body, poses, tool, joints, tool_use.hands):
            break
        swing = 0.95 * swing
    else:
        return None
    span = (0, len(xy))
    return Handling(
        poses, grip_holds(body, joints, poses, tool.bar, tool_use.hands, span, tool_use.times)
    )


def _tool(tool_use: ToolUse) -> _Tool:
    vertices = np.unique(np.concatenate([p.vertices for p in tool_use.prop.parts]), axis=0)
    low = sole(tool_use.prop)
    foot = np.array([*(low.min(axis=0) + low.max(axis=0))[:2] / 2, 0.0])
    centres = tool_use.grasp.points + tool_use.grasp.inward * _GRIP
    upper = int(centres[:, 2].argmax())
    up = centres[upper] - centres[1 - upper]
    up = up / np.linalg.norm(up)
    if tool_use.prop.name in _PLAIN:
        # Nothing on such a pole is in the way of hands that take it higher up.
        end = float((vertices @ up).max()) - tool_use.spare
        centres = centres + (end - float(centres[upper] @ up)) * up
    middle = centres.mean(axis=0) if all(tool_use.hands) else centres[upper]
    if not all(tool_use.hands):
        centres = np.stack([middle, middle])
    line = middle - foot
    length = float(np.linalg.norm(line))
    slant = float(np.arcsin(line[2] / length))
    bar, side = ToolBar(centres, np.stack([up, up])), 1.0 - 2.0 * upper
    return _Tool(vertices, foot, middle, bar, length, side, slant)


def _swing(
    rng: np.random.Generator, tool_use: ToolUse, frames: int
) -> Float[np.ndarray, "frames 2"]:
    """Where the head is, away from the middle of its strokes: outward and to the left, metres."""
    pace = gaussian_filter1d(rng.normal(size=frames + 80), 20.0)[40:-40]
    pace = 1.0 + 0.15 * pace / max(float(pace.std()), 1e-9)
    phase = 2 * np.pi * (rng.random() + np.cumsum(tool_use.rate * pace.clip(0.6, 1.4)) / FPS)
    reach = gaussian_filter1d(rng.normal(size=frames + 80), 15.0)[40:-40]
    reach = (
        tool_use.length / 2 * (1.0 + 0.15 * reach / max(float(reach.std()), 1e-9)).clip(0.6, 1.3)
    )
    # The way back is not as fast as the way there.
    wave = np.sin(phase + rng.uniform(-0.3, 0.3) * np.sin(phase))
    drift = 0.04 * gaussian_filter1d(rng.normal(size=(frames, 2)), 25.0, axis=0) * 8
    if tool_use.stroke == "to_and_fro":
        return drift + np.stack([reach * wave, 0.06 * np.sin(phase * 0.31)], axis=-1)
    deep = (
        0.35 * reach * np.sin(2 * phase)
        if tool_use.stroke == "eight"
        else 0.05 * np.sin(0.4 * phase)
    )
    return drift + np.stack([deep, reach * wave], axis=-1)


def _poses(
    tool: _Tool,
    tool_use: ToolUse,
    xy: Float[np.ndarray, "frames 2"],
    yaw: Float[np.ndarray, " frames"],
    place: Float[np.ndarray, " 2"],
    swing: Float[np.ndarray, "frames 2"],
    lift: Float[np.ndarray, " frames"],
) -> Float[np.ndarray, "frames 4 4"]:
    """The sole where the stroke has it, the hands as far above the floor as the slant puts them."""
    rises = np.clip([tool.slant - _SWIVEL, tool.slant + _SWIVEL], *_RISE)
    rise = np.arcsin(np.clip(tool_use.height / tool.length, *np.sin(rises)))
    out = _turned(yaw + tool_use.aside)
    if not all(tool_use.hands):
        place = np.array([place[0] - 0.08, 0.2 if tool_use.hands[0] else -0.2])
    palms = xy + _turned(yaw) @ place
    stroke = np.einsum("tij,tj->ti", out, swing)
    sole = palms + tool.length * np.cos(rise) * out[..., 0] + stroke
    palms = palms + tool_use.follow * stroke
    apart = sole - palms
    far = np.linalg.norm(apart, axis=-1)
    # Where the tool cannot rise or sink any farther the hands go along.
    now = np.arccos((far / tool.length).clip(np.cos(rises[1]), np.cos(rises[0])))
    now = gaussian_filter1d(now, 2.0, mode="nearest")
    turn = np.stack([np.unwrap(np.arctan2(apart[:, 1], apart[:, 0])), now - tool.slant], axis=-1)
    poses = np.tile(np.eye(4), (len(xy), 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("ZY", turn).as_matrix()
    poses[:, :2, 3] = sole - poses[:, :2, :3] @ tool.sole
    poses[:, 2, 3] = lift - (poses[:, None, 2, :3] @ tool.vertices.T).min(axis=-1)[:, 0]
    return poses


def _turned(yaw: Float[np.ndarray, " frames"]) -> Float[np.ndarray, "frames 2 2"]:
    """Columns: ahead, left."""
    return np.stack([ahead_of(yaw), left_of(yaw)], axis=-1)


def _in_reach(
    body: BodyModel,
    poses: Float[np.ndarray, "frames 4 4"],
    tool: _Tool,
    joints: Float[np.ndarray, "frames 24 3"],
    hands: tuple[bool, bool],
) -> bool:
    arm = sum(arm_lengths(body))
    for hand in (h for h in (0, 1) if hands[h]):
        palm = poses[:, :3, :3] @ tool.bar.centres[hand] + poses[:, :3, 3]
        shoulder = joints[:, joint("left_shoulder") + hand]
        far = np.linalg.norm(palm - shoulder, axis=-1).max()
        low, high = palm[:, 2].min(), palm[:, 2].max()
        if low < _LOWEST or high > _HIGHEST or far > _FARTHEST * arm:
            return False
    return True


def _room(
    poses: Float[np.ndarray, "frames 4 4"], tool: _Tool, joints: Float[np.ndarray, "frames 24 3"]
) -> float:
    """Least distance from the pole's end to the line from pelvis to neck, metres."""
    top = tool.vertices[tool.vertices[:, 2].argmax()]
    end = poses[:, :3, :3] @ top + poses[:, :3, 3]
    low, high = joints[:, joint("pelvis")], joints[:, joint("neck")]
    line = high - low
    u = ((end - low) * line).sum(-1, keepdims=True) / (line**2).sum(-1, keepdims=True)
    return float(np.linalg.norm(end - low - u.clip(0.0, 1.0) * line, axis=-1).min())
