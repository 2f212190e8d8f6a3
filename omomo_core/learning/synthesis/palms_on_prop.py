"""Paths of the palms and turns of the hands: toward the prop, on it, away from it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from omomo_core.geometry.runs import min_jerk
from omomo_core.learning.synthesis.holds import Handling, Hold
from omomo_core.learning.synthesis.props.grasp_surfaces import slope

PALM_THICKNESS = 0.02
"""From the skin of the palm to the palm joint inside the hand, metres."""
_DETOUR = 0.12
"""How far outside the straight line a hand swings on its way, metres."""
_HOP = 0.07
"""How far a hand lifts off when it moves from one place of the prop to another, metres."""
_SPARE = 6
"""Frames a hand needs at least between going and coming to hang free."""


@dataclass(frozen=True)
class Hands:
    """Goals of both hands; index 0 is left, 1 right."""

    palms: Float[np.ndarray, "frames 2 3"]
    """Palm joints while held, world, metres (on the resting prop before and after)."""
    R_world_wrist: Float[np.ndarray, "frames 2 3 3"]
    outward: Float[np.ndarray, "frames 2 3"]
    """Away from the surface, metres: the detour of a hand that is half way."""
    pull: Float[np.ndarray, "frames 2"]
    """0 where the hand is free, 1 where it holds, smooth between."""
    contact: Float[np.ndarray, "frames 2"]


@dataclass(frozen=True)
class _Hand:
    """Goals of one hand, prop frame."""

    anchor: Float[np.ndarray, "frames 3"]
    R_prop_wrist: Float[np.ndarray, "frames 3 3"]
    outward: Float[np.ndarray, "frames 3"]
    pull: Float[np.ndarray, " frames"]


def plan_hands(handling: Handling, yaw: Float[np.ndarray, " frames"] | None = None) -> Hands:
    """Goals for both hands from the prop's motion and its holds.

    Args:
        handling: where the prop goes and how it is held. Where a hold does not say where the
            fingers point they are guessed from how high the hand is (see `along_forearms`).
        yaw: the actor's heading, for that guess; by default the prop's.
    """
    T = handling.T_world_prop
    R = T[:, :3, :3]
    sides = [_plan_hand(_fingered(handling, h, yaw), len(T)) for h in (0, 1)]
    anchors = np.stack([s.anchor for s in sides], axis=1)
    wrists = np.stack([s.R_prop_wrist for s in sides], axis=1)
    outward = np.stack([s.outward for s in sides], axis=1)
    return Hands(
        palms=np.einsum("tij,thj->thi", R, anchors) + T[:, None, :3, 3],
        R_world_wrist=R[:, None] @ wrists,
        outward=np.einsum("tij,thj->thi", R, outward),
        pull=np.stack([s.pull for s in sides], axis=1),
        contact=handling.held.astype(float),
    )


def along_forearms(handling: Handling, joints: Float[np.ndarray, "frames 24 3"]) -> Handling:
    """Let fingers that are free to choose point along the forearms of a first performance."""
    holds: list[Hold] = []
    for hold in handling.holds:
        rows = slice(hold.first, hold.last)
        along = joints[rows, 20 + hold.hand] - joints[rows, 18 + hold.hand]
        mean = np.einsum("tji,tj->i", handling.T_world_prop[rows, :3, :3], along)
        holds.append(hold if hold.fingers is not None else replace(hold, fingers=mean))
    return Handling(handling.T_world_prop, tuple(holds))


def _fingered(
    handling: Handling, hand: int, yaw: Float[np.ndarray, " frames"] | None
) -> list[Hold]:
    """The holds of one hand in the order of time, all with fingers."""
    holds = sorted((h for h in handling.holds if h.hand == hand), key=lambda h: h.first)
    return [
        h if h.fingers is not None else replace(h, fingers=_guessed_fingers(h, handling, yaw))
        for h in holds
    ]


def _guessed_fingers(
    hold: Hold, handling: Handling, yaw: Float[np.ndarray, " frames"] | None
) -> Float[np.ndarray, " 3"]:
    """Fingers along a forearm that points down to a low hand and up to a high one."""
    T = handling.T_world_prop[hold.first : hold.last]
    height = np.einsum("tj,j->t", T[:, 2, :3], hold.point) + T[:, 2, 3]
    drop = slope(height)
    of_prop = np.arctan2(T[:, 1, 0], T[:, 0, 0])
    yaw = of_prop if yaw is None else yaw[hold.first : hold.last]
    along = np.stack([np.cos(drop) * np.cos(yaw), np.cos(drop) * np.sin(yaw), -np.sin(drop)], -1)
    return np.einsum("tji,tj->i", T[:, :3, :3], along)


def _plan_hand(holds: Sequence[Hold], frames: int) -> _Hand:
    if not holds:
        eye = np.tile(np.eye(3), (frames, 1, 1))
        zero = np.zeros((frames, 3))
        return _Hand(zero, eye, zero, np.zeros(frames))
    t = np.arange(frames)
    turns = [_hand_rotation(h) for h in holds]
    anchors = [h.point - h.inward * PALM_THICKNESS for h in holds]
    anchor, wrist = np.tile(anchors[0], (frames, 1)), np.tile(turns[0], (frames, 1, 1))
    outward = np.tile(-_DETOUR * holds[0].inward, (frames, 1))
    pull = _pull(holds[0], t)
    for k, (before, after) in enumerate(pairwise(holds), start=1):
        middle = (before.last + after.first) // 2
        start = before.last - 1
        if after.first - before.last < before.release + after.reach + _SPARE:
            # Too short to hang free: the hand goes straight to its next place.
            u = min_jerk((t - start) / (after.first - start))
            pull[(t >= start) & (t <= after.first)] = 1.0
            pull[t > after.first] = _pull(after, t)[t > after.first]
        else:
            u = (t >= middle).astype(float)
            pull = np.where(t < middle, pull, _pull(after, t))
        side = -_HOP * (before.inward + after.inward) / 2
        anchor += u[:, None] * (anchors[k] - anchors[k - 1]) + (4 * u * (1 - u))[:, None] * side
        outward += u[:, None] * -_DETOUR * (after.inward - before.inward)
        wrist = wrist @ _part_of(turns[k - 1].T @ turns[k], u)
    return _Hand(anchor, wrist, outward, pull)


def _pull(hold: Hold, t: np.ndarray) -> Float[np.ndarray, " frames"]:
    coming = min_jerk((t - hold.first + hold.reach) / hold.reach) if hold.reach else np.ones(len(t))
    going = (hold.last - 1 + hold.release - t) / max(hold.release, 1)
    return coming * (min_jerk(going) if hold.release else 1.0)


def _part_of(
    turn: Float[np.ndarray, "3 3"], u: Float[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames 3 3"]:
    rotvec = Rotation.from_matrix(turn).as_rotvec()
    return Rotation.from_rotvec(u[:, None] * rotvec).as_matrix()


def _hand_rotation(hold: Hold) -> Float[np.ndarray, "3 3"]:
    """R_prop_wrist: palm on the surface, fingers as near as possible to the wanted direction."""
    inward, fingers = hold.inward, hold.fingers
    assert fingers is not None
    flat = fingers - inward * (inward @ fingers)
    x = flat / np.linalg.norm(flat) * (1.0 if hold.hand == 0 else -1.0)
    return np.stack([x, -inward, np.cross(x, -inward)], axis=-1)
