"""Detours: how a palm goes from one place of an object to another without going through it."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from omomo_core.contact.config import ANCHOR, DETOUR
from omomo_core.geometry.surface import Surface

Way = Float[np.ndarray, "points 3"]
"""Points in the object's frame, metres; the first and the last are the places."""


def way_between(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"], surface: Surface) -> Way:
    """Return the straight way from `a` to `b`, or the shortest curve around what is in between.

    Curves are cubic, leave and arrive along the surface's normal, and swing out to any side; where none is
    clear, the way is straight.

    Args:
        a: where the palm joint leaves, in the object's frame, metres.
        b: where it arrives.
        surface: the object's.
    """
    if np.linalg.norm(b - a) < 1e-6:
        return np.stack([a, b])
    ways = _curves(a, b, surface)
    lengths = np.linalg.norm(np.diff(ways, axis=1), axis=-1).sum(axis=1)
    ways = ways[np.argsort(lengths, kind="stable")]
    near = surface.tree.query(ways[:, 1:-1], distance_upper_bound=ANCHOR.palm_thickness)[0]
    least = ANCHOR.least_clearance * ANCHOR.palm_thickness
    # Where it leaves and arrives, a palm is as near as the places themselves.
    ends = np.linalg.norm(ways[:, 1:-1, None] - np.stack([a, b]), axis=-1).min(axis=-1)
    clear = ((near >= least) | (ends < ANCHOR.palm_thickness)).all(axis=1)
    return ways[int(clear.argmax())] if clear.any() else _straight(a, b)


def length_of(way: Way) -> float:
    """Return the metres from a way's first point to its last."""
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def along(way: Way, share: Float[np.ndarray, " frames"]) -> Float[np.ndarray, "frames 3"]:
    """Return where a palm is that has gone these shares of a way's length, from 0 to 1."""
    steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
    gone = np.append(0.0, np.cumsum(steps)) / max(float(steps.sum()), 1e-9)
    return np.stack([np.interp(share, gone, x) for x in way.T], axis=1)


def _straight(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> Way:
    return a + np.linspace(0, 1, DETOUR.points)[:, None] * (b - a)


def _curves(
    a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"], surface: Surface
) -> Float[np.ndarray, "ways points 3"]:
    """Return the straight way and the curves, which lift off by `lift` and swing out by `swing`."""
    lift, swing, side = _choices()
    u, v = _across(b - a)
    out = swing[:, None] * (np.cos(side)[:, None] * u + np.sin(side)[:, None] * v)
    t = np.linspace(0, 1, DETOUR.points)[:, None]
    first, last = (p + lift[:, None] * _off(p, surface) + out for p in (a, b))
    curves = (
        (1 - t) ** 3 * a
        + 3 * t * (1 - t) ** 2 * first[:, None]
        + 3 * t**2 * (1 - t) * last[:, None]
        + t**3 * b
    )
    return np.concatenate([_straight(a, b)[None], curves])


@lru_cache(maxsize=1)
def _choices() -> tuple[Float[np.ndarray, " ways"], ...]:
    sides = np.linspace(0, 2 * np.pi, DETOUR.sides, endpoint=False)
    choices = np.meshgrid(DETOUR.lifts, DETOUR.swings, sides, indexing="ij")
    return tuple(choice.ravel() for choice in choices)


def _across(way: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return two directions square to a way and to each other."""
    ahead = way / np.linalg.norm(way)
    u = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin()])
    u /= np.linalg.norm(u)
    return u, np.cross(ahead, u)


def _off(place: Float[np.ndarray, "3"], surface: Surface) -> Float[np.ndarray, "3"]:
    """Return the direction from the nearest point of the surface to a place."""
    off = place - surface.points[surface.tree.query(place)[1]]
    return off / max(float(np.linalg.norm(off)), 1e-9)
