"""The prop's trajectory: at rest, taken, moved with the body or before it, put down."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import min_jerk
from omomo_core.learning.synthesis.action_plan import ActionPlan, Episode, PropPlacement, Span
from omomo_core.learning.synthesis.base_motion import (
    ActorPath,
    BaseMotion,
    actor_path,
    ahead_of,
    left_of,
)
from omomo_core.learning.synthesis.holds import Handling, Hold
from omomo_core.motion import FPS
from omomo_core.skeleton import joint

_OFF_REACH = 10
"""Frames a hand takes to come off and to come back."""


def holds_of(episode: Episode, span: Span) -> list[Hold]:
    """Every palm's contacts in one episode.

    Args:
        episode: which grasp, which hands, and whether one lets go for a while.
        span: frames with the prop in the hands.
    """
    first, last = span
    grasp = episode.grasp
    holds: list[Hold] = []
    for hand, used in enumerate(episode.hands):
        if not used:
            continue
        late = episode.late[hand]
        begin, end = first + late * episode.takes, last - late * episode.leaves
        reach = (episode.reach + late // 2) * episode.takes
        release = (episode.release + late // 2) * episode.leaves
        place = (grasp.points[hand], grasp.inward[hand], grasp.fingers)
        gone = episode.off
        if gone is None or hand != free_hand(episode) or not _fits(gone, begin, end):
            holds.append(Hold(hand, begin, end, *place, reach, release))
            continue
        leave, back = begin + gone[0], begin + gone[0] + gone[1]
        holds.append(Hold(hand, begin, leave, *place, reach, _OFF_REACH))
        holds.append(Hold(hand, back, end, *place, _OFF_REACH, release))
    return holds


def both_come(episode: Episode, span: Span) -> bool:
    """Whether the later hand arrives before it has to leave, in the frames with the prop in the hands."""
    first, last = span
    return first + max(episode.late) * (episode.takes + episode.leaves) < last


def free_hand(episode: Episode) -> int:
    """The hand that lets go where one does."""
    return int(episode.late[0] > episode.late[1])


def _fits(off: Span, begin: int, end: int) -> bool:
    return begin + sum(off) + 10 < end


Path = Float[np.ndarray, "rows 5"]
"""x, y of the prop were it upright, height of its bottom, yaw, pitch."""
_Place = Float[np.ndarray, "1 5"]
"""The same where it rests."""

_SIDE_DISTANCE = 0.235
"""From the middle of the body to the near side of a thing carried beside the leg, metres."""
_CLEARANCE: dict[tuple[str, str], float] = {
    ("pelvis", "pelvis"): 0.14,
    ("spine2", "spine2"): 0.14,
    ("spine3", "spine3"): 0.14,
    ("neck", "neck"): 0.09,
    ("head", "head"): 0.13,
    **{
        (f"{side}_{a}", f"{side}_{b}"): flesh
        for side in ("left", "right")
        for a, b, flesh in (
            ("hip", "hip", 0.11),
            ("hip", "knee", 0.09),
            ("knee", "knee", 0.07),
            ("knee", "ankle", 0.06),
            ("ankle", "ankle", 0.06),
            ("foot", "foot", 0.09),
        )
    },
}
"""Flesh in front of the middle of two joints, metres."""
_ABOVE, _BESIDE = 0.1, 0.08
"""How far from its middle flesh may meet a thing, metres."""
_FARTHEST = ([0.3, 0.6, 0.75, 0.9, 1.05, 1.3, 1.6], [0.75, 0.6, 0.45, 0.42, 0.5, 0.48, 0.38])
"""From the pelvis to palms at a height that an upright body holds, or one that bends for low things."""
_STEP_CLOSE = ([0.3, 0.9, 1.4, 1.75], [0.6, 1.0, 1.0, 0.3])
"""What a reach becomes for palms at a height: bending takes the pelvis back, so for low things people
step up, until the hands are some 20 cm and half the thing's depth before the ankles (NIOSH 1991); what
clears the head is held above it."""
_LOWEST_FLIGHT = 0.02


def prop_trajectory(
    rng: np.random.Generator, body: BodyModel, base_motion: BaseMotion, action_plan: ActionPlan
) -> Handling:
    """Return the motion of the prop, which follows the action plan and the actor's base motion."""
    sigma = rng.uniform(6.0, 12.0)
    actor = actor_path(body, base_motion, sigma, sigma * 1.2)
    poses = np.tile(np.eye(4), (len(base_motion.root), 1, 1))
    rest: _Place | None = None
    holds: list[Hold] = []
    spans = action_plan.spans(base_motion.pauses)
    for k, (episode, span) in enumerate(zip(action_plan.episodes, spans, strict=True)):
        path, rest = _episode(rng, actor, action_plan, episode, span, rest)
        begin = 0 if k == 0 else (spans[k - 1][1] + span[0]) // 2
        poses[begin:] = _poses(path, action_plan, episode)[begin:]
        holds += holds_of(episode, span)
    return Handling(poses, tuple(holds))


def _episode(
    rng: np.random.Generator,
    actor: ActorPath,
    action_plan: ActionPlan,
    episode: Episode,
    span: Span,
    rest: _Place | None,
) -> tuple[Path, _Place]:
    """The prop's path before, in and after one episode, and where it is left."""
    first, last = span
    t = np.arange(len(actor.xy))
    early, before, after = max(episode.late), *episode.supports
    if rest is None:
        rest = _beside(actor, action_plan, episode, 0, np.array([first]), np.array([before]))
        rest[:, 2] = before
    if episode.shove is not None:
        path = rest + _change(episode)
        path = np.tile(path, (len(t), 1))
        end = rest if episode.shove.back else path[:1]
    else:
        heights = _heights(rng, episode, span, t)
        path = _beside(actor, action_plan, episode, 1, t, heights)
        path += _sway(rng, actor, episode, t, span)
        end = _beside(actor, action_plan, episode, 2, np.array([last - 1]), np.array([after]))
        end[:, 2] = after
        # The shorter way round: the body's own turns are part of both.
        path[:, 3] += 2 * np.pi * np.round((rest[0, 3] - path[first, 3]) / (2 * np.pi))
        end[:, 3] += 2 * np.pi * np.round((path[last - 1, 3] - end[0, 3]) / (2 * np.pi))
    if episode.takes:
        taking = (t - first - 2 - early) / episode.lift
        path = _towards(rest, path, taking)
        path[:, 4] += _tilt_half_way(episode) * np.sin(np.pi * taking.clip(0.0, 1.0)) ** 2
    if episode.leaves:
        path = _towards(end, path, (last - 3 - early - t) / episode.lower)
    return path, end


def _change(episode: Episode) -> Float[np.ndarray, " 5"]:
    shove = episode.shove
    assert shove is not None
    return np.array([shove.ahead, shove.aside, 0.0, shove.yaw, shove.pitch])


def _tilt_half_way(episode: Episode) -> float:
    return 0.0 if episode.shove is None else episode.shove.tilt


def _beside(
    actor: ActorPath,
    action_plan: ActionPlan,
    episode: Episode,
    moment: int,
    rows: np.ndarray,
    heights: Float[np.ndarray, " rows"],
) -> Path:
    """The pose relative to the body at three moments: 0 taken, 1 held, 2 left."""
    stance = episode.stances[moment]
    near = _near_distance(actor, action_plan, episode, stance, rows, heights)
    phase = 2 * np.pi * episode.swinging[1] * rows / FPS
    angle = actor.yaw[rows] + stance.swing
    if moment == 1:
        angle = angle + episode.swinging[0] * np.sin(phase)
    at = actor.xy[rows] + near * ahead_of(angle)
    at = at + _aside(action_plan, episode, stance) * left_of(angle)
    yaw, pitch = angle + stance.turn, np.full(len(rows), stance.pitch)
    return np.column_stack([at, heights, yaw, pitch])


def _near_distance(
    actor: ActorPath,
    action_plan: ActionPlan,
    episode: Episode,
    stance: PropPlacement,
    rows: np.ndarray,
    heights: Float[np.ndarray, " rows"],
) -> float:
    """How far ahead the prop's origin is such that it does not touch the body."""
    if _beside_leg(episode):
        return (0.12 if len(rows) == 1 else 0.02) - float(_palm(episode)[0])
    parts, palm = _before(action_plan, episode, stance)
    angle = actor.yaw[rows] + stance.swing
    farthest = np.interp(float(heights.max()) + palm[2], *_FARTHEST) + 0.2 * episode.slides
    close = np.interp(float(heights.mean()) + palm[2], *_STEP_CLOSE)
    needed = [min(stance.reach * float(close), float(farthest)) - float(palm[0])]
    for names, flesh in _CLEARANCE.items():
        at = actor.joints[rows][:, [joint(name) for name in names]].mean(axis=1)
        offset = at - actor.joints[rows, 0]
        ahead = offset[:, 0] * np.cos(angle) + offset[:, 1] * np.sin(angle) + flesh
        aside = offset[:, 1] * np.cos(angle) - offset[:, 0] * np.sin(angle)
        z = at[:, 2] - heights
        for low, high in parts:
            meets = (z > low[2] - _ABOVE) & (z < high[2] + _ABOVE)
            meets &= (aside > low[1] - _BESIDE) & (aside < high[1] + _BESIDE)
            if meets.any():
                needed.append(float(np.quantile(ahead[meets], 0.85)) + 0.02 - float(low[0]))
    return max(needed)


_Box = tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]


def _before(
    action_plan: ActionPlan, episode: Episode, stance: PropPlacement
) -> tuple[list[_Box], Float[np.ndarray, " 3"]]:
    """Corners of the prop's parts as it is turned and tilted before the actor, and its palms.

    Part by part, because feet go under a table.
    """
    pose = _poses(np.array([[0.0, 0.0, 0.0, stance.turn, stance.pitch]]), action_plan, episode)[0]
    shift = pose[:3, 3] + np.array([0.0, stance.aside, 0.0])
    corners = [part.vertices @ pose[:3, :3].T + shift for part in action_plan.prop.parts]
    palm = pose[:3, :3] @ _palm(episode) + shift
    return [(c.min(axis=0), c.max(axis=0)) for c in corners], palm


def _aside(action_plan: ActionPlan, episode: Episode, stance: PropPlacement) -> float:
    """Sideways offset: a thing in one hand hangs beside the leg."""
    outward = 1.0 if episode.hands[0] else -1.0
    if all(episode.hands):
        return stance.aside
    if not _beside_leg(episode):
        return stance.aside + 0.14 * outward - float(_palm(episode)[1])
    half = float(action_plan.prop.high[1] - action_plan.prop.low[1]) / 2
    return outward * (_SIDE_DISTANCE + half) + 0.3 * stance.aside


def _beside_leg(episode: Episode) -> bool:
    """Carried by a handle at the side of the body, not before it."""
    return episode.grasp.use == "one_hand" and episode.grasp.kind == "handle"


def _palm(episode: Episode) -> Float[np.ndarray, " 3"]:
    """The middle of the palms in use, prop frame."""
    return episode.grasp.points[list(episode.hands)].mean(axis=0)


def _heights(
    rng: np.random.Generator, episode: Episode, span: Span, t: np.ndarray
) -> Float[np.ndarray, " frames"]:
    """Height of the bottom while held: one level after the other."""
    levels = episode.heights or (0.0,)
    out = np.full(len(t), levels[0])
    begin, end = span[0] + episode.lift, span[1] - episode.lower
    for k, (a, b) in enumerate(pairwise(levels), start=1):
        at = begin + (end - begin) * (k - 0.5 + rng.uniform(-0.2, 0.2)) / (len(levels) - 1)
        frames = 18 + 45 * abs(b - a)
        out = out + (b - a) * min_jerk((t - at + frames / 2) / frames)
    return out


def _sway(
    rng: np.random.Generator, actor: ActorPath, episode: Episode, t: np.ndarray, span: Span
) -> Path:
    """What arms do to a held thing: it bobs with the steps, drifts and rocks a little."""
    frames = len(t)
    noise = gaussian_filter1d(rng.normal(size=(frames + 80, 5)), rng.uniform(8, 16), axis=0)
    noise = noise[40:-40] / max(float(noise.std()), 1e-9)
    scale = np.array([0.012, 0.012, 0.01, 0.03, 0.025])
    if episode.slides:
        scale = np.array([0.006, 0.006, 0.0, 0.02, 0.0])
    sway = noise * scale * rng.uniform(0.3, 1.3)
    if not episode.slides:
        z = actor.joints[:, 0, 2]
        bob = gaussian_filter1d(z, 1.5) - gaussian_filter1d(z, 15.0)
        sway[:, 2] += rng.uniform(0.4, 0.9) * np.roll(bob, int(rng.integers(0, 3)))
        sway[:, 2] = sway[:, 2].clip(-min(episode.heights) + _LOWEST_FLIGHT)
    slow = gaussian_filter1d(rng.normal(size=(frames + 120, 2)), rng.uniform(12, 22), axis=0)
    slow = slow[60:-60] / max(float(np.abs(slow).max()), 1e-9)
    sway[:, 3] += episode.gesture * slow[:, 0]
    sway[:, 4] += episode.gesture * slow[:, 1] * (not episode.slides)
    return sway


def _towards(rest: _Place, path: Path, progress: Float[np.ndarray, " rows"]) -> Path:
    """`rest` where progress is below 0, `path` where it is above 1: up first, then closer."""
    up = min_jerk(progress / 0.85)[:, None]
    along = min_jerk((progress - 0.2) / 0.8)[:, None]
    weight = np.concatenate([along, along, up, along, along], axis=1)
    return rest + weight * (path - rest)


def _poses(path: Path, action_plan: ActionPlan, episode: Episode) -> Float[np.ndarray, "rows 4 4"]:
    """Prop poses: tilted about the palms in the air, about its edge on the floor.

    In the air it tilts away from the actor, however it is turned; on the floor about its own edge.
    """
    yaw, pitch = path[:, 3], path[:, 4]
    turn = 0.0 if episode.slides else episode.stances[1].turn
    angles = np.column_stack([yaw - turn, pitch, np.full(len(path), turn)])
    turned = Rotation.from_euler("ZYZ", angles).as_matrix()
    upright = Rotation.from_euler("Z", yaw[:, None]).as_matrix()
    if episode.slides:
        low, high = action_plan.prop.low, action_plan.prop.high
        edge = np.where(pitch > 0, high[0], low[0])
        pivot = np.stack([edge, 0.0 * edge, 0.0 * edge], axis=-1)
    else:
        pivot = np.tile(_palm(episode), (len(path), 1))
    poses = np.tile(np.eye(4), (len(path), 1, 1))
    poses[:, :3, :3] = turned
    poses[:, :3, 3] = path[:, :3] + np.einsum("tij,tj->ti", upright - turned, pivot)
    vertices = np.concatenate([p.vertices for p in action_plan.prop.parts])
    lowest = (turned[:, 2] @ vertices.T).min(axis=1)
    if episode.slides:
        poses[:, 2, 3] = path[:, 2] - lowest
    else:
        # A tilted thing is put down on its lowest corner, not through the floor.
        sunk = path[:, 2] - lowest - poses[:, 2, 3]
        grounded = np.exp(-((path[:, 2] - min(episode.supports)) / 0.1).clip(0.0))
        poses[:, 2, 3] = np.maximum(poses[:, 2, 3] + sunk * grounded, -lowest)
    return poses
