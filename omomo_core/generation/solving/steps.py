"""Steps for gliding feet: a sampled body sometimes travels without moving its legs.

Where neither foot stands although the body travels, the feet are given alternate steps whose stances lie
under the hips in their middle, as in walking. The sampled feet say where the hips want them.
"""

from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing, binary_opening

from omomo_core.generation.solving.config import STEPS
from omomo_core.geometry.easing import min_jerk
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import velocity
from omomo_core.motion import FPS


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
