"""The plan of the feet: which foot stands where and when, and the steps between.

Where neither foot stands although the body travels, the feet are given alternate steps whose stances lie
under the hips in their middle, as in walking. The sampled feet say where the hips want them.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing, binary_opening, gaussian_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.model import BodyModel
from omomo_core.generation.solving.solving_config import FOOT_PLAN, STEPS
from omomo_core.geometry.runs import min_jerk, runs
from omomo_core.geometry.transforms import velocity
from omomo_core.motion import FPS
from omomo_core.skeleton import joint


def add_steps(
    ankles: Float[np.ndarray, "frames 2 3"],
    planted: Bool[np.ndarray, "frames 2"],
    prefix_standing: Bool[np.ndarray, "first 2"],
) -> tuple[Float[np.ndarray, "frames 2 3"], Bool[np.ndarray, "frames 2"]]:
    """Return ankles with gliding replaced by steps.

    Args:
        ankles: sampled left and right ankle, world, metres.
        planted: whether the sample says that each stands.
        prefix_standing: whether each stands in the frames of a prefix, where ankles stay as they are.

    Returns:
        Ankles that step where they glided, and which of them stand; elsewhere as given.
    """
    speed = np.linalg.norm(velocity(ankles[..., :2], FPS), axis=-1)
    stepped, standing = ankles.copy(), planted & (speed < STEPS.standing_speed)
    standing[: len(prefix_standing)] = prefix_standing
    for start, stop in _glides(speed):
        begin = max(start, len(prefix_standing) - 1)
        if begin >= stop:
            continue
        feet, stands = stepped.copy(), standing.copy()
        _walk(ankles, feet, stands, begin, stop)
        _rejoin(ankles, feet, stands, stop)
        # Where there is no time to put both feet down, gliding looks better than a leap.
        short = stop - begin < STEPS.hurried
        if not (short and _fastest(feet[begin : stop + 1]) > STEPS.fastest):
            stepped, standing = feet, stands
    return stepped, standing


def _fastest(ankles: Float[np.ndarray, "frames 2 3"]) -> float:
    """Return the largest speed of an ankle, metres a second."""
    return FPS * float(np.linalg.norm(np.diff(ankles, axis=0), axis=-1).max(initial=0.0))


def _glides(speed: Float[np.ndarray, "frames 2"]) -> list[tuple[int, int]]:
    """Return the stretches in which no foot stands, short interruptions bridged."""
    gliding = speed.min(axis=1) > STEPS.standing_speed
    gliding = binary_closing(np.pad(gliding, STEPS.longest_gap), np.ones(STEPS.longest_gap))[
        STEPS.longest_gap : -STEPS.longest_gap
    ]
    gliding = binary_opening(gliding, np.ones(STEPS.shortest_glide))
    return runs(gliding)


def _walk(
    home: Float[np.ndarray, "frames 2 3"],
    stepped: Float[np.ndarray, "frames 2 3"],
    standing: Bool[np.ndarray, "frames 2"],
    start: int,
    stop: int,
) -> None:
    """Fill frames start..stop of `stepped` and `standing` with alternate steps."""
    last = min(stop, len(home) - 1)
    way = home[start : last + 1].mean(axis=1)[:, :2]
    pace = FPS * np.linalg.norm(np.diff(way, axis=0), axis=1).mean()
    # Longer and quicker steps at a faster walk: about 1.75 a second at 0.8 m/s.
    count = max(2, round((last - start) / FPS * (STEPS.cadence + STEPS.cadence_per_speed * pace)))
    times = np.linspace(start, last, count + 1)
    # A foot that is in the air goes first, or else the one that lags behind the way.
    ahead = (home[start, 0, :2] - home[start, 1, :2]) @ (way[-1] - way[0])
    side = int(ahead > 0) if standing[start].all() else int(standing[start, 0])
    place = home[start].copy()
    standing[start : last + 1] = True
    stepped[start : last + 1] = place
    for begin, end in pairwise(times):
        middle_of_stance = round(min(end + (end - begin) / 2, last))
        goal = home[middle_of_stance, side]
        lift = STEPS.lift * min(
            1.0, np.linalg.norm(goal[:2] - place[side, :2]) / STEPS.full_lift_length
        )
        a, b = round(begin), round(begin + STEPS.swing * (end - begin))
        u = np.clip((np.arange(a, b + 1) - a) / max(1, b - a), 0, 1)[:, None]
        path = place[side] + (3 * u**2 - 2 * u**3) * (goal - place[side])
        path[:, 2] += lift * np.sin(np.pi * u[:, 0])
        stepped[a : b + 1, side] = path
        stepped[b + 1 : last + 1, side] = goal
        standing[a + 1 : b, side] = False
        place[side] = goal
        side = 1 - side


def _rejoin(
    home: Float[np.ndarray, "frames 2 3"],
    stepped: Float[np.ndarray, "frames 2 3"],
    standing: Bool[np.ndarray, "frames 2"],
    stop: int,
) -> None:
    """Let feet that are in the air after a walk come from where it left them to where the sample has them."""
    if stop + 1 >= len(home):
        return
    for side in range(2):
        landed = np.flatnonzero(standing[stop + 1 :, side])
        free = min(STEPS.rejoining, landed[0] if len(landed) else len(home) - stop - 1)
        share = min_jerk(1 - np.arange(1, free + 1) / (free + 1))
        after = slice(stop + 1, stop + 1 + free)
        stepped[after, side] += share[:, None] * (stepped[stop, side] - home[stop, side])


ANKLES = (joint("left_ankle"), joint("right_ankle"))
TOES = (joint("left_foot"), joint("right_foot"))


@dataclass(frozen=True)
class FootPlan:
    """Planned left and right foot of one body."""

    ankles: Float[np.ndarray, "frames 2 3"]
    """World, metres."""
    rotations: Float[np.ndarray, "frames 2 2 3 3"]
    """R_world_joint of ankle and toes of each foot."""
    standing: Bool[np.ndarray, "frames 2"]
    rolling: Bool[np.ndarray, "frames 2"]
    """The heel is up where the foot stands on its toes."""


def plan_feet(
    body: BodyModel,
    joints: Float[np.ndarray, "frames 24 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    foot_contact: Float[np.ndarray, "frames 4"],
    prefix_standing: Bool[np.ndarray, "first 2"] | None = None,
) -> FootPlan:
    """Return the foot plan of one sampled body.

    Args:
        body: whose feet.
        joints: of the sample, world, metres.
        rotations: global R_world_joint.
        foot_contact: probability that left ankle, right ankle, left toe, right toe is planted.
        prefix_standing: which feet stand in the frames of a prefix; there the sample is the finished body,
            and a foot that stands stays in place.
    """
    heel, toe = (foot_contact[:, k : k + 2] > FOOT_PLAN.planted for k in (0, 2))
    prefix_standing = np.zeros((0, 2), bool) if prefix_standing is None else prefix_standing
    first = len(prefix_standing)
    ankles, standing = add_steps(joints[:, ANKLES], heel | toe, prefix_standing)
    planned = ankles.copy()
    turned = rotations[:, (*ANKLES, *TOES)].reshape(-1, 2, 2, 3, 3).swapaxes(1, 2).copy()
    rolls = toe & ~heel
    for side in range(2):
        rolling = rolls[:, side]
        plants = [p for p in runs(standing[:, side]) if p[1] - p[0] >= FOOT_PLAN.shortest_plant]
        turned[:, side] = _flatten_plants(turned[:, side], plants, rolling, first)
        offset = body.rest_joints[TOES[side]] - body.rest_joints[ANKLES[side]]
        to_toe = turned[:, side, 0] @ offset.double().numpy()
        levels = (_level(body, ANKLES[side]), _level(body, TOES[side]))
        still = _lock_plants(ankles[:, side], to_toe, plants, rolling, levels, first)
        for level, offset in zip(levels, (0.0, to_toe[:, 2]), strict=True):
            still[:, 2] += (level - still[:, 2] - offset).clip(min=0)
        still[:, 2] += _raise_swings(still, to_toe[:, 2] - levels[1], standing[:, side], first)
        planned[:, side] = still
    if first:
        planned = _continue_prefix(planned, joints[:first, ANKLES])
    return FootPlan(planned, turned, standing, rolls)


def _flatten_plants(
    R: Float[np.ndarray, "frames 2 3 3"],
    plants: list[tuple[int, int]],
    rolling: Bool[np.ndarray, " frames"],
    first: int,
) -> Float[np.ndarray, "frames 2 3 3"]:
    """Return rotations with one heading for each plant, level but for an ankle that rises over its toes."""
    goal, weight = R.copy(), np.zeros(len(R))
    for a, b in plants:
        frames = np.arange(a, b)
        seen = frames[frames < first] if a < first else frames
        ahead = R[seen, 0, :2, 2].mean(axis=0)
        yaw = np.arctan2(ahead[1], ahead[0])
        flat = _facing(np.full(len(frames), yaw))
        goal[frames, 1] = flat
        own = np.arctan2(R[frames, 0, 1, 2], R[frames, 0, 0, 2])
        risen = Rotation.from_rotvec([0.0, 0.0, 1.0] * (yaw - own)[:, None]).as_matrix()
        rolled = risen @ R[frames, 0]
        goal[frames, 0] = np.where(rolling[frames, None, None], rolled, flat)
        weight[frames] = 1.0
    change = Rotation.from_matrix((goal @ R.swapaxes(-1, -2)).reshape(-1, 3, 3)).as_rotvec()
    change = change.reshape(len(R), 2, 3) * weight[:, None, None]
    # A turn begins before its foot is down and ends after it has left.
    near = np.maximum(gaussian_filter1d(weight, FOOT_PLAN.ease, mode="nearest"), 1e-3)[
        :, None, None
    ]
    eased = gaussian_filter1d(change, FOOT_PLAN.ease, axis=0, mode="nearest")
    inside = (weight > 0)[:, None, None]
    change = np.where(inside, change, eased / np.maximum(near, 0.5))
    change[:first] = 0.0
    return Rotation.from_rotvec(change.reshape(-1, 3)).as_matrix().reshape(R.shape) @ R


def _facing(yaw: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 3 3"]:
    """Return R_world_joint of a level foot: its z ahead, its y up."""
    c, s, o = np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)
    x, y, z = np.stack([-s, c, o], -1), np.stack([o, o, o + 1], -1), np.stack([c, s, o], -1)
    return np.stack([x, y, z], axis=-1)


def _lock_plants(
    ankle: Float[np.ndarray, "frames 3"],
    to_toe: Float[np.ndarray, "frames 3"],
    plants: list[tuple[int, int]],
    rolling: Bool[np.ndarray, " frames"],
    levels: tuple[float, float],
    first: int,
) -> Float[np.ndarray, "frames 3"]:
    """Return an ankle whose foot stands still in each plant; the change is interpolated between plants.

    Where only the toe is down (`rolling`) the foot turns about it and the ankle rises.
    """
    frames, moves = [np.arange(first)], [np.zeros((first, 3))]
    for a, b in plants:
        plant = np.arange(a, b)
        seen = plant[plant < first] if a < first else plant
        flat = seen[~rolling[seen]]
        toe = ankle + to_toe
        if len(flat):
            place = np.median(ankle[flat], axis=0)
            place[2] = levels[0]
            ball = place + np.median(to_toe[flat], axis=0)
        else:
            place = ball = np.median(toe[seen], axis=0)
        ball[2] = levels[1]
        move = np.where(rolling[plant, None], ball - toe[plant], place - ankle[plant])
        frames.append(plant[plant >= first])
        moves.append(move[plant >= first])
    known, change = np.concatenate(frames), np.concatenate(moves)
    if not len(known):
        return ankle.copy()
    return ankle + np.stack([np.interp(np.arange(len(ankle)), known, m) for m in change.T], axis=1)


def _raise_swings(
    ankle: Float[np.ndarray, "frames 3"],
    to_toe: Float[np.ndarray, " frames"],
    standing: Bool[np.ndarray, " frames"],
    first: int,
) -> Float[np.ndarray, " frames"]:
    """Return by how much an ankle is raised so that its toe clears the floor in each step, as people's do.

    Args:
        ankle: of one foot, world, metres.
        to_toe: height of its toe joint above the ankle, less that of one that stands.
        standing: whether the foot stands.
        first: frames of a prefix, which stay as they are.
    """
    raised = np.zeros(len(ankle))
    for a, b in runs(~standing):
        if a <= first or b == len(ankle):
            continue
        length = float(np.linalg.norm(ankle[b, :2] - ankle[a - 1, :2]))
        least = FOOT_PLAN.least_swing + FOOT_PLAN.swing_per_metre * length
        highest = float((ankle[a:b, 2] + to_toe[a:b]).max())
        lack = max(0.0, min(least, FOOT_PLAN.highest_swing) - highest)
        raised[a:b] = lack * np.sin(np.pi * (np.arange(b - a) + 0.5) / (b - a)) ** 2
    return raised


def _continue_prefix(
    planned: Float[np.ndarray, "frames 2 3"], prefix: Float[np.ndarray, "first 2 3"]
) -> Float[np.ndarray, "frames 2 3"]:
    """Return ankles that begin with the prefix; a jump after it, which new steps may make, fades out."""
    first = len(prefix)
    before = prefix[-2:].mean(axis=0)
    step = prefix[-1] - before if first > 1 else np.zeros((2, 3))
    jump = prefix[-1] + 2 * step - planned[min(first, len(planned) - 1)]
    weight = (1 - np.arange(len(planned) - first) / FOOT_PLAN.settle).clip(min=0)
    weight = weight**2 * (3 - 2 * weight)
    rest = planned[first:] + weight[:, None, None] * jump
    return np.concatenate([prefix, rest])


def _level(body: BodyModel, name: int) -> float:
    """Return the height of a foot's joint when it stands, metres."""
    return float(body.rest_joints[name, 1] - body.vertices[:, 1].min())
