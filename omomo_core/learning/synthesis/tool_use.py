"""Tools at work: sweeping, mopping, vacuuming, and the grip of pole and bar."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.base_motion import BaseMotion, ahead_of, heading, left_of
from omomo_core.learning.synthesis.holds import Handling, Hold
from omomo_core.learning.synthesis.props.prop import Grasp, Prop
from omomo_core.motion import FPS
from omomo_core.skeleton import PALM_JOINTS, joint

ToolAction = Literal["sweep", "mop", "vacuum", "trolley", "cart"]
PROPS: dict[ToolAction, str] = {
    "sweep": "broom",
    "mop": "mop",
    "vacuum": "vacuum",
    "trolley": "suitcase",
    "cart": "pushcart",
}
"""What each action is done with."""
Stroke = Literal["to_and_fro", "sideways", "eight"]
_SOLE = 0.025
"""What is at most so far above the lowest point stands on the floor, metres."""
_HANDS = 0.3
"""Farthest way of the hands in a stroke; the rest is in the slant of the pole, metres."""
_WHEELBASE = 0.35
"""What has no wheels so far apart falls over, metres."""


@dataclass(frozen=True)
class ToolUse:
    """The choices of one clip; lengths in metres, angles in radians, times in frames."""

    action: ToolAction
    prop: Prop
    grasp: Grasp
    hands: tuple[bool, bool]
    """Which hands (left, right) hold it."""
    takes: bool
    """False when it is in the hands from the first frame."""
    leaves: bool
    """False when it is still in the hands at the last frame."""
    reach: int
    release: int
    settle: int
    """Standing still between reaching and going, and between coming and releasing."""
    stops: tuple[int, ...]
    """Stops on the way, at work."""
    stroke: Stroke
    length: float
    """Length of a stroke of the head on the floor, from end to end."""
    rate: float
    """Strokes there and back per second."""
    aside: float
    """Direction of the head from the actor's heading, positive to the left."""
    follow: float
    """How much of the head's way the hands go with it."""
    height: float
    """Height of the middle of the hands, where the prop leaves a choice."""
    ahead: float
    """From the pelvis to the hands."""
    spare: float
    """Length of a pole beyond the upper hand, metres."""

    @property
    def pause_frames(self) -> list[int]:
        """How long the actor must stand still for each thing that happens standing."""
        take, leave = self.reach + self.settle, self.settle + self.release
        return [take] * self.takes + list(self.stops) + [leave] * self.leaves

    def span(self, pauses: list[tuple[int, int]], frames: int) -> tuple[int, int]:
        """First and one past the last frame in the hands, from where the actor stops."""
        first = pauses[0][0] + self.reach if self.takes else 0
        last = pauses[-1][1] - self.release if self.leaves else frames
        return max(first, 0), min(last, frames)

    @property
    def times(self) -> tuple[int, int]:
        """Frames of reaching and releasing; 0 where the prop stays in the hands."""
        return self.reach * self.takes, self.release * self.leaves


def draw_tool_use(
    rng: np.random.Generator, action: ToolAction, prop: Prop, frames: int
) -> ToolUse | None:
    """Draw everything that belongs to an action; None where the prop cannot be used for it."""
    grasps = [g for g in prop.grasps if _suits(prop, g, action)]
    if not grasps:
        return None
    rolls = action in ("trolley", "cart")
    takes, leaves = (rng.random(2) < 0.55) if rolls else (False, False)
    one = action == "trolley" or (action == "vacuum" and rng.random() < 0.5)
    left = bool(rng.random() < 0.5)
    stroke, length = _stroke(rng, action)
    return ToolUse(
        action=action,
        prop=prop,
        grasp=grasps[rng.integers(len(grasps))],
        hands=(left, not left) if one else (True, True),
        takes=bool(takes),
        leaves=bool(leaves),
        reach=int(rng.uniform(16, 28)),
        release=int(rng.uniform(16, 28)),
        settle=int(rng.uniform(12, 30)),
        stops=_stops(rng, rolls, frames),
        stroke=stroke,
        length=length,
        rate=rng.uniform(0.4, 0.9) * min(1.0, 0.62 / length),
        aside=_aside(rng, action),
        follow=min(rng.uniform(0.35, 0.8), _HANDS / length),
        height=rng.uniform(0.82, 1.05),
        ahead=rng.uniform(0.38, 0.48) if rolls else rng.uniform(0.3, 0.42),
        spare=rng.uniform(0.05, 0.35),
    )


def _suits(prop: Prop, grasp: Grasp, action: ToolAction) -> bool:
    """Two places on one bar: poles for strokes, rails for wheels."""
    if prop.name != PROPS[action]:
        return False
    apart = float(np.linalg.norm(grasp.points[0] - grasp.points[1]))
    if action not in ("trolley", "cart"):
        return (
            grasp.use == "tool" and grasp.kind == "pole" and not grasp.one_handed and apart > 0.12
        )
    across = float(grasp.points[0, 1] - grasp.points[1, 1])
    if grasp.use != "push" or grasp.kind != "rail" or not across > 0.9 * apart > 0.02:
        return False
    on_floor = sole(prop)
    at, height = float(grasp.points[:, 0].mean()), float(grasp.points[:, 2].mean())
    back = float(on_floor[:, 0].min())
    if action == "trolley":
        return abs(at - back) < 0.1 and height > 0.85
    long = float(np.ptp(on_floor[:, 0]))
    return at < back + 0.12 and long > _WHEELBASE and 0.8 < height < 1.1


def sole(prop: Prop) -> Float[np.ndarray, "verts 3"]:
    """The lowest vertices of an upright prop: head or wheels."""
    vertices = np.concatenate([p.vertices for p in prop.parts])
    return vertices[vertices[:, 2] < vertices[:, 2].min() + _SOLE]


def _stops(rng: np.random.Generator, rolls: bool, frames: int) -> tuple[int, ...]:
    """Wheels roll on; strokes are made walking, standing, or first the one and then the other."""
    if rolls or rng.random() < 0.3:
        return ()
    return (int(rng.uniform(0.3, 0.95) * frames),)


def _stroke(rng: np.random.Generator, action: ToolAction) -> tuple[Stroke, float]:
    if action == "mop" and rng.random() < 0.55:
        return ("eight" if rng.random() < 0.4 else "sideways"), rng.uniform(0.35, 0.8)
    return "to_and_fro", rng.uniform(0.3, 0.65 if action == "sweep" else 0.8)


def _aside(rng: np.random.Generator, action: ToolAction) -> float:
    """Brooms are swept beside the body, mops and vacuums before it."""
    if action == "sweep":
        return rng.choice([-1.0, 1.0]) * rng.uniform(0.0, 0.8)
    return float(np.clip(rng.normal(0.0, 0.22), -0.5, 0.5))


_OBLIQUE = 0.5
"""Cosine of the least angle between the forearm's direction in the hand and the pole: 60 degrees."""
_RADIUS = 0.012
_SIDES = ("left", "right")


@dataclass(frozen=True)
class ToolBar:
    """A straight piece of a prop that hands close around, prop frame."""

    centres: Float[np.ndarray, "2 3"]
    """On its axis, where the left and the right palm go, metres."""
    thumbs: Float[np.ndarray, "2 3"]
    """Which way along the axis each thumb points, unit length."""


def grip_holds(
    body: BodyModel,
    joints: Float[np.ndarray, "frames 24 3"],
    T_world_prop: Float[np.ndarray, "frames 4 4"],
    bar: ToolBar,
    hands: tuple[bool, bool],
    span: tuple[int, int],
    times: tuple[int, int],
) -> tuple[Hold, ...]:
    """Holds of one or both hands on a bar, turned as the forearms will come.

    Args:
        body: whose arms.
        joints: of the base motion, world, metres.
        T_world_prop: the prop's motion.
        bar: where on the prop.
        hands: which hands (left, right) hold it.
        span: first and one past the last frame of contact.
        times: frames of reaching and of releasing.
    """
    holds: list[Hold] = []
    for hand in (h for h in (0, 1) if hands[h]):
        forearm = _forearm(body, joints, T_world_prop, bar.centres[hand], hand, span)
        inward, fingers = around(bar.thumbs[hand], forearm, hand)
        point = bar.centres[hand] - inward * _RADIUS
        holds.append(Hold(hand, *span, point, inward, fingers, *times))
    return tuple(holds)


def around(
    thumb: Float[np.ndarray, " 3"], forearm: Float[np.ndarray, " 3"], hand: int
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Which way palm and fingers of a hand around a bar point, unit length.

    Args:
        thumb: along the bar.
        forearm: from elbow to wrist.
        hand: 0 left, 1 right.
    """
    along = float(np.clip(forearm @ thumb, -_OBLIQUE, _OBLIQUE))
    across = forearm - (forearm @ thumb) * thumb
    across = across / max(float(np.linalg.norm(across)), 1e-9)
    fingers = along * thumb + np.sqrt(1 - along**2) * across
    return np.cross(thumb, across) * (1.0 if hand == 1 else -1.0), fingers


def _forearm(
    body: BodyModel,
    joints: Float[np.ndarray, "frames 24 3"],
    T: Float[np.ndarray, "frames 4 4"],
    centre: Float[np.ndarray, " 3"],
    hand: int,
    span: tuple[int, int],
) -> Float[np.ndarray, " 3"]:
    """Mean direction of a forearm whose elbow hangs down and out, prop frame."""
    rows = slice(*span)
    upper, lower = arm_lengths(body)
    palm = T[rows, :3, :3] @ centre + T[rows, :3, 3]
    shoulder = joints[rows, joint(f"{_SIDES[hand]}_shoulder")]
    other = joints[rows, joint(f"{_SIDES[1 - hand]}_shoulder")]
    to_palm = palm - shoulder
    distance = np.linalg.norm(to_palm, axis=-1, keepdims=True)
    line = to_palm / distance
    far = np.minimum(distance, 0.97 * (upper + lower))
    along = (upper**2 - lower**2 + far**2) / (2 * far)
    aside = np.sqrt(np.maximum(upper**2 - along**2, 0.0))
    down = 0.35 * (shoulder - other) + np.array([0.0, 0.0, -0.4])
    down -= (down * line).sum(-1, keepdims=True) * line
    down /= np.linalg.norm(down, axis=-1, keepdims=True)
    forearm = line * far - (along * line + aside * down)
    mean = np.einsum("tji,tj->i", T[rows, :3, :3], forearm)
    return mean / np.linalg.norm(mean)


def arm_lengths(body: BodyModel) -> tuple[float, float]:
    """Shoulder to elbow, elbow to palm, metres."""
    rest = body.rest_joints.double().numpy()
    chain = [joint("left_shoulder"), joint("left_elbow"), PALM_JOINTS[0]]
    upper, lower = (float(np.linalg.norm(rest[b] - rest[a])) for a, b in pairwise(chain))
    return upper, lower


_SWIVEL = np.radians(14)
"""How far the pole may rise or sink from the slant at which the head lies flat."""
_RISE = (np.radians(36), np.radians(80))
_TRUNK = 0.17
"""Least distance from the end of the pole to the middle of the trunk, metres."""
_LOWEST, _HIGHEST = 0.62, 1.36
"""Metres above the floor; nobody bends lower for a long pole, or holds it before the throat."""
_FARTHEST = 1.25
"""Part of a straight arm, from the base motion's shoulders: the trunk leans and turns for the rest."""
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
    """Middle of the hands, on the axis."""
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
    """Return the head's offset from the middle of its strokes: outward and to the left, metres."""
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
