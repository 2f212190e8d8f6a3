"""Base motion made of recorded steps and standing poses: walks, steps and turns around stops."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing, gaussian_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of, sole_points
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.learning.recordings.grounding import foot_contacts
from omomo_core.learning.synthesis.base_motion import (
    BaseMotion,
    Footage,
    Stretch,
    heading,
    idle_sway,
    mirrored,
)
from omomo_core.learning.synthesis.walker.footsteps import (
    CHANCES,
    Chances,
    Move,
    RootPath,
    draw_move,
    lay,
)
from omomo_core.learning.synthesis.walker.gait import Bearing, blend_poses, step_along
from omomo_core.motion import FPS
from omomo_core.skeleton import joint

_STILL = 0.75
_APART = (0.10, 0.36)
_STAGGER = 0.22
_UPRIGHT = 0.94
"""Cosine of the largest lean of the chest."""
_PALMS_OVER_PELVIS = 0.0
_HANGING = 0.85
"""Cosine between the upper arms and straight down: hands are on no hips, and point nowhere."""
_PER_STRETCH = 4
_ANKLES = (joint("left_ankle"), joint("right_ankle"))
_SHOULDERS = (joint("left_shoulder"), joint("right_shoulder"))
_ELBOWS = (joint("left_elbow"), joint("right_elbow"))
_TOES = (joint("left_foot"), joint("right_foot"))
_PALMS = (22, 23)
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class StandingPoses:
    """Standing poses, each facing world x with the pelvis over the origin."""

    height: Float[np.ndarray, " poses"]
    rotations: Float[np.ndarray, "poses 22 3 3"]
    apart: Float[np.ndarray, "poses 2 2"]
    toe_out: Float[np.ndarray, "poses 2"]


def find_standing(footage: Footage, body: BodyModel) -> StandingPoses:
    """Frames of the mocap in which somebody stands at ease, and their mirror images.

    Raises:
        InputError: ``walker-standing`` when there is none.
    """
    found: list[tuple[float, np.ndarray, np.ndarray, np.ndarray]] = []
    for stretch in footage.stretches:
        still = np.flatnonzero(stretch.stops > _STILL)
        if len(still):
            picked = still[np.linspace(0, len(still) - 1, _PER_STRETCH).round().astype(int)]
            for one in (stretch, mirrored(stretch)):
                found += _at_ease(one, np.unique(picked), body)
    if not found:
        raise InputError(
            "walker-standing",
            "Nobody in the mocap stands still with both feet on the floor.",
            fix="Give clips in which somebody stops and stands for a moment.",
        )
    heights, rotations, apart, toe_out = zip(*found, strict=True)
    return StandingPoses(np.array(heights), np.array(rotations), np.array(apart), np.array(toe_out))


def vary_standing_poses(
    rng: np.random.Generator, standing: StandingPoses, changes: list[tuple[int, int]], frames: int
) -> Bearing:
    """Standing poses that change, one after another, during the given stretches of frames."""
    picks = rng.integers(len(standing.height), size=len(changes) + 1)
    share = np.zeros((len(changes), frames))
    for k, (first, last) in enumerate(changes):
        u = ((np.arange(frames) - first) / max(last - first, 1)).clip(0.0, 1.0)
        share[k] = u * u * (3 - 2 * u)
    weight = np.vstack([np.ones(frames), share]) - np.vstack([share, np.zeros(frames)])
    rotations = np.tile(standing.rotations[picks[0]], (frames, 1, 1, 1))
    for k, (first, last) in enumerate(changes):
        rotations[last:] = standing.rotations[picks[k + 1]]
        rotations[first:last] = blend_poses(
            standing.rotations[picks[k]], standing.rotations[picks[k + 1]], share[k, first:last]
        )
    return Bearing(
        height=standing.height[picks] @ weight,
        rotations=rotations,
        apart=np.einsum("kt,kfx->tfx", weight, standing.apart[picks]),
        toe_out=np.einsum("kt,kf->tf", weight, standing.toe_out[picks]),
    )


def _at_ease(
    stretch: Stretch, frames: np.ndarray, body: BodyModel
) -> list[tuple[float, np.ndarray, np.ndarray, np.ndarray]]:
    yaw = gaussian_filter1d(heading(stretch.rotations), 2.0)[frames]
    back = Rotation.from_rotvec(-yaw[:, None] * _UP).as_matrix()
    rotations = back[:, None] @ stretch.rotations[frames]
    height = stretch.root[frames, 2]
    root = np.stack([0 * height, 0 * height, height], axis=-1)
    joints = joints_of(body, root, rotations)
    ankles = joints[:, list(_ANKLES), :2]
    forward = rotations[:, list(_TOES)][..., 2]
    toe_out = np.arctan2(forward[..., 1], forward[..., 0])
    apart = ankles[:, 0] - ankles[:, 1]
    good = (apart[:, 1] > _APART[0]) & (apart[:, 1] < _APART[1])
    good &= np.abs(apart[:, 0]) < _STAGGER
    good &= (np.abs(toe_out) < 0.7).all(axis=1) & (height > 0.86 * height_of(body))
    good &= rotations[:, joint("spine3"), 2, 1] > _UPRIGHT
    good &= (joints[:, list(_PALMS), 2] < height[:, None] + _PALMS_OVER_PELVIS).all(axis=1)
    upper_arms = joints[:, list(_ELBOWS)] - joints[:, list(_SHOULDERS)]
    hang = -upper_arms[..., 2] / np.linalg.norm(upper_arms, axis=-1)
    good &= (hang > _HANGING).all(axis=1)
    # The feet belong under the body, also where the pose leans on one leg.
    centre = ankles.mean(axis=1, keepdims=True) * 0.5
    return [
        (float(height[k]), rotations[k], ankles[k] - centre[k], toe_out[k])
        for k in np.flatnonzero(good)
    ]


def height_of(body: BodyModel) -> float:
    """Height of the pelvis over the soles when the legs are straight, metres."""
    return float(body.rest_joints[0, 1] - body.vertices[:, 1].min())


@dataclass(frozen=True)
class MotionLibrary:
    """Small enough to be sent to every worker process once."""

    body: BodyModel
    """Bones and floor only: its surface is one triangle of no use."""
    standing: StandingPoses
    licence: str
    """Licence of all mocap in it."""


def index(footage: Footage, body: BodyModel) -> MotionLibrary:
    """Look up how people stand and walk in the mocap.

    Raises:
        InputError: ``walker-standing`` when nobody in the footage stands at ease.
    """
    standing = find_standing(footage, body)
    licences = sorted({stretch.licence for stretch in footage.stretches})
    return MotionLibrary(_bones(body), standing, "; ".join(licences))


def _bones(body: BodyModel) -> BodyModel:
    """The body without its surface, of which only the lowest point matters here."""
    lowest = int(body.vertices[:, 1].argmin())
    kept = slice(lowest, lowest + 1)
    return replace(
        body,
        vertices=body.vertices[kept].clone(),
        faces=torch.zeros(0, 3, dtype=torch.int64),
        skin_joints=body.skin_joints[kept].clone(),
        skin_weights=body.skin_weights[kept].clone(),
    )


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
