"""Improvised base motion with stops of given lengths: walks, steps and turns around the stops."""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing

from omomo_core.body.kinematics import joints_of
from omomo_core.body.soles import sole_points
from omomo_core.geometry.runs import runs
from omomo_core.learning.recordings.grounding import foot_contacts
from omomo_core.learning.synthesis.base_motion import BaseMotion, idle_sway
from omomo_core.learning.synthesis.walker.bearing import vary_standing_poses
from omomo_core.learning.synthesis.walker.gait import step_along
from omomo_core.learning.synthesis.walker.library import MotionLibrary
from omomo_core.learning.synthesis.walker.path import (
    CHANCES,
    Chances,
    Move,
    RootPath,
    draw_move,
    lay,
)
from omomo_core.motion import FPS
from omomo_core.skeleton import joint

_LIFT_EARLY = 12
"""Frames before a move in which the first foot may already begin to leave the floor."""
_SETTLE = 24
"""Frames after a move until the other foot has followed."""
_SHORTEST_MOVE = 14
_LONGEST_HURRY = 45
_LONGEST_IDLE = 60
_STRIDE = 0.45
_SIDE_BY_SIDE, _CROSSED = 0.08, 0.04
"""Metres between the ankles, across the body: when standing, and ever."""
_TWISTED = 0.45
"""Cosine of the largest angle between a foot and the pelvis, 63 degrees."""
_AT_REST = 0.03
"""Metres per second of a foot that stands."""
_TOWARDS: Chances = {"walk": 0.62, "side": 0.1, "turn": 0.08, "orbit": 0.2}
"""Chances of the move that ends in front of the object; some come round it."""
_AWAY: Chances = {"back": 0.6, "turn": 0.2, "side": 0.12, "shuffle": 0.08}
"""Chances of the first move away from the object."""
_TRIES = 6

_PATH_AT_REST = 0.02
"""Speed of a path at rest, metres (or 0.3 radians) per second."""


def improvise(
    rng: np.random.Generator,
    library: MotionLibrary,
    frames: int,
    pause_frames: list[int],
    walk: tuple[int, int] = (0, 10_000),
    chances: Chances = CHANCES,
    *,
    comes: bool = True,
    goes: bool = True,
) -> BaseMotion | None:
    """Make up a base motion with a stop of each given length, in this order.

    Args:
        rng: source of all randomness.
        library: from `index`.
        frames: length of the result.
        pause_frames: length of each stop; there is movement between two stops.
        walk: least and most frames between two stops.
        chances: of each kind of move between the stops.
        comes: before the first stop the actor walks up to the object; else moves as between the stops.
        goes: after the last stop the actor leaves the object; else moves as between the stops.

    Returns:
        None where there is no time to move between the stops.
    """
    for _ in range(_TRIES):
        plan = _plan(rng, frames, pause_frames, walk, chances, (comes, goes))
        if plan is None:
            return None
        parts, lead, pauses = plan
        path = lay(parts, yaw=rng.uniform(-np.pi, np.pi))
        root, rotations = follow(rng, library, path)
        shown = slice(lead, lead + frames)
        base_motion = BaseMotion(root[shown], rotations[shown], idle_sway(rng, frames), pauses)
        if _sound(library, base_motion):
            return base_motion
    return None


_Plan = tuple[list[Move | int], int, list[tuple[int, int]]]
"""Moves and rests, how many of their first frames are cut off, and the (start, stop) of each stop."""


def _plan(
    rng: np.random.Generator,
    frames: int,
    pause_frames: list[int],
    walk: tuple[int, int],
    chances: Chances,
    ends: tuple[bool, bool],
) -> _Plan | None:
    gaps = _gaps(rng, frames - sum(pause_frames), len(pause_frames), walk)
    if gaps is None:
        return None
    under_way = _approaching(0.7) if chances is CHANCES else chances
    if ends[0] and pause_frames:
        parts, lead = _arrive(rng, gaps[0])
    else:
        parts, lead = _come_along(rng, gaps[0], under_way, _SETTLE if pause_frames else 0)
    pauses: list[tuple[int, int]] = []
    at = gaps[0]
    for pause, gap in zip(pause_frames, gaps[1:], strict=False):
        pauses.append((at, at + pause))
        parts.append(pause + _LIFT_EARLY)
        at += pause + gap
        if len(pauses) < len(pause_frames):
            moves = _fill(rng, gap - _LIFT_EARLY - _SETTLE, chances)
            parts += [*moves, _SETTLE]
    if pause_frames and ends[1]:
        parts += _leave(rng, gaps[-1])
    elif pause_frames:
        parts += _fill(rng, gaps[-1] + int(rng.integers(0, 60)), under_way)
    return parts, lead, pauses


def _gaps(
    rng: np.random.Generator, moving: int, stops: int, walk: tuple[int, int]
) -> list[int] | None:
    """Frames before, between and after the stops, at random; None where they are too few."""
    if stops == 0:
        return [moving]
    least = max(walk[0], _LIFT_EARLY + _SHORTEST_MOVE + _SETTLE)
    most = max(walk[1], least)
    spare = moving - least * (stops - 1)
    if spare < 0:
        return None
    share = rng.dirichlet([1.2] + [3.0] * (stops - 1) + [1.0])
    between = [least + min(int(s * spare), most - least) for s in share[1:-1]]
    outside = moving - sum(between)
    before = round(outside * share[0] / (share[0] + share[-1]))
    return [before, *between, outside - before]


def _come_along(
    rng: np.random.Generator, frames: int, chances: Chances, settle: int
) -> tuple[list[Move | int], int]:
    """Return the moves before the first stop of an actor who holds the object, and the frames to cut off."""
    lead = max(int(rng.integers(10, 70)), settle + 2 * _SHORTEST_MOVE - frames)
    return [*_fill(rng, frames + lead - settle, chances), settle], lead


def _arrive(rng: np.random.Generator, frames: int) -> tuple[list[Move | int], int]:
    """Return the same with empty hands: the actor walks up to the object and reaches with the last step."""
    if frames < _LONGEST_IDLE and rng.random() < 0.15:
        return [frames], 0
    # Where the other foot has not followed in time, the next try may.
    settle = int(rng.integers(_SETTLE // 4, _SETTLE))
    lead = max(int(rng.integers(10, 70)), settle + 2 * _SHORTEST_MOVE - frames)
    up = _step(rng, frames + lead - settle, _TOWARDS, 1.0)
    left = frames + lead - settle - up.frames
    return [*_fill(rng, left, _approaching(0.75)), up, settle], lead


def _leave(rng: np.random.Generator, frames: int) -> list[Move | int]:
    """Return the moves after the last stop: the object is ahead, so the actor first steps back or turns."""
    if frames < _SHORTEST_MOVE or (frames < _LONGEST_IDLE and rng.random() < 0.15):
        return [frames]
    frames += int(rng.integers(0, 60))
    away = _step(rng, frames, _AWAY, -1.0)
    return [away, *_fill(rng, frames - away.frames, _approaching(0.6))]


def _step(rng: np.random.Generator, frames: int, chances: Chances, way: float) -> Move:
    """Return a move that fits, else as much of a step ahead (`way` 1) or back (-1) as fits."""
    move = draw_move(rng, chances)
    if move.frames <= frames:
        return move
    frames = min(frames, _LONGEST_HURRY)
    far = rng.uniform(0.3, 0.7) * frames / FPS
    return Move("shuffle", (way * far, rng.normal(0.0, 0.05)), rng.normal(0.0, 0.2), frames)


def _approaching(walk: float) -> Chances:
    """Return chances of moves in which `walk` is the share of walks."""
    chances = dict(CHANCES)
    chances["walk"] = walk / (1 - walk) * (sum(CHANCES.values()) - CHANCES["walk"])
    return chances


def _fill(rng: np.random.Generator, frames: int, chances: Chances) -> list[Move | int]:
    """Return moves and moments of rest that together last exactly `frames`."""
    parts: list[Move | int] = []
    left = frames
    while left >= _SHORTEST_MOVE:
        moves = [draw_move(rng, chances) for _ in range(6)]
        fitting = [move for move in moves if move.frames <= left]
        move = fitting[0] if fitting else _hurried(rng, min(left, _LONGEST_HURRY))
        parts.append(move)
        left -= move.frames
        rest = int(rng.integers(0, 16)) if rng.random() < 0.6 else 0
        rest = min(rest, left)
        parts.append(rest)
        left -= rest
    parts.insert(0 if rng.random() < 0.5 else len(parts), left)
    return parts


def _hurried(rng: np.random.Generator, frames: int) -> Move:
    """Return a small step in a random direction that lasts exactly `frames`."""
    way, far = rng.uniform(-np.pi, np.pi), 0.3 * frames / FPS
    return Move("shuffle", (far * np.cos(way), far * np.sin(way)), rng.normal(0.0, 0.2), frames)


def _sound(library: MotionLibrary, base_motion: BaseMotion) -> bool:
    """Return whether both feet stand near each other in the stops, and legs never cross or twist."""
    joints = joints_of(library.body, base_motion.root, base_motion.rotations)
    apart = joints[:, joint("left_ankle")] - joints[:, joint("right_ankle")]
    across = (apart * base_motion.rotations[:, 0, :, 0]).sum(-1)
    soles = sole_points(library.body, base_motion.root, base_motion.rotations)
    down = foot_contacts(soles)
    stands = (down[:, 0] | down[:, 2]) & (down[:, 1] | down[:, 3]) & (across > _SIDE_BY_SIDE)
    stands &= np.linalg.norm(apart[:, :2], axis=-1) < _STRIDE
    moved = np.linalg.norm(np.gradient(soles, axis=0), axis=-1).max(axis=1) * FPS
    # Of the feet the axis to the left tells where they point: it stays level when the heel rises.
    toes = base_motion.rotations[:, [joint("left_foot"), joint("right_foot")]]
    along = np.einsum("tfi,ti->tf", toes[..., 0], base_motion.rotations[:, 0, :, 0])
    return bool(across.min() > _CROSSED and along.min() > _TWISTED) and all(
        stands[a:b].all() and moved[a:b].max() < _AT_REST for a, b in base_motion.pauses
    )


def follow(
    rng: np.random.Generator, library: MotionLibrary, path: RootPath
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Walk, step and turn along a path.

    Args:
        rng: picks how the person stands, and which foot goes first.
        library: from `index`.
        path: at rest where the person should stand.

    Returns:
        Pelvis (world, metres) and global R_world_joint at every frame of the path.
    """
    frames = len(path.heading)
    bearing = vary_standing_poses(rng, library.standing, runs(_moving(path)), frames)
    return step_along(rng, library.body, bearing, path)


def _moving(path: RootPath) -> Bool[np.ndarray, " frames"]:
    """Frames in which the path is not at rest; moments of rest between two moves do not count."""
    speed = np.linalg.norm(np.gradient(path.position, axis=0), axis=1)
    speed = (speed + np.abs(np.gradient(path.heading)) * 0.1) * FPS
    return binary_closing(speed > _PATH_AT_REST, np.ones(9, bool))
