"""Detours: the path of a palm from one place of an object to another, not through it."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

from omomo_core.contact.config import ANCHOR, DETOUR
from omomo_core.geometry.surface import Surface

Path = Float[np.ndarray, "points 3"]
"""Points in the object's frame, metres, from the first place to the last."""
Paths = Float[np.ndarray, "paths points 3"]


def path_between(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"], surface: Surface) -> Path:
    """Return the straight path from `a` to `b`, or the shortest clear curve where the object is between them.

    Where no curve is clear, the path is straight.

    Args:
        a: where the palm joint leaves, in the object's frame, metres.
        b: where it arrives.
        surface: the object's.
    """
    paths = possible_paths(a, b, surface)
    near = surface.tree.query(paths[:, 1:-1], distance_upper_bound=ANCHOR.palm_thickness)[0]
    least = ANCHOR.least_clearance * ANCHOR.palm_thickness
    # Near its ends a path is as close to the surface as the places themselves.
    ends = np.linalg.norm(paths[:, 1:-1, None] - np.stack([a, b]), axis=-1).min(axis=-1)
    clear = ((near >= least) | (ends < ANCHOR.palm_thickness)).all(axis=1)
    return paths[int(clear.argmax())] if clear.any() else _straight(a, b)


def possible_paths(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"], surface: Surface) -> Paths:
    """Return the straight path and curves from `a` to `b`, shortest first; no curves where `a` is `b`.

    They are cubic Bézier curves that leave and arrive along the surface's normal and bulge to one of several
    sides. The arguments are those of `path_between`.
    """
    if np.linalg.norm(b - a) < 1e-6:
        return _straight(a, b)[None]
    lift, bulge, side = _choices()
    u, v = _across(b - a)
    out = bulge[:, None] * (np.cos(side)[:, None] * u + np.sin(side)[:, None] * v)
    t = np.linspace(0, 1, DETOUR.points)[:, None]
    first, last = (p + lift[:, None] * _off(p, surface) + out for p in (a, b))
    curves = (
        (1 - t) ** 3 * a
        + 3 * t * (1 - t) ** 2 * first[:, None]
        + 3 * t**2 * (1 - t) * last[:, None]
        + t**3 * b
    )
    paths = np.concatenate([_straight(a, b)[None], curves])
    return paths[np.argsort(length_of(paths), kind="stable")]


def length_of(paths: Float[np.ndarray, "*b points 3"]) -> Float[np.ndarray, "*b"]:
    """Return the length of each path, metres."""
    return np.asarray(np.linalg.norm(np.diff(paths, axis=-2), axis=-1).sum(axis=-1))


def along(path: Path, share: Float[np.ndarray, " frames"]) -> Float[np.ndarray, "frames 3"]:
    """Return the points at these shares of a path's length, from 0 to 1."""
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    gone = np.append(0.0, np.cumsum(steps)) / max(float(steps.sum()), 1e-9)
    return np.stack([np.interp(share, gone, x) for x in path.T], axis=1)


def _straight(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> Path:
    return a + np.linspace(0, 1, DETOUR.points)[:, None] * (b - a)


@lru_cache(maxsize=1)
def _choices() -> tuple[Float[np.ndarray, " curves"], ...]:
    """Return lift, bulge and side of each curve."""
    sides = np.linspace(0, 2 * np.pi, DETOUR.sides, endpoint=False)
    choices = np.meshgrid(DETOUR.lifts, DETOUR.bulges, sides, indexing="ij")
    return tuple(choice.ravel() for choice in choices)


def _across(line: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return two unit vectors at right angles to a line and to each other."""
    ahead = line / np.linalg.norm(line)
    u = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin()])
    u /= np.linalg.norm(u)
    return u, np.cross(ahead, u)


def _off(place: Float[np.ndarray, "3"], surface: Surface) -> Float[np.ndarray, "3"]:
    """Return the direction from the nearest point of the surface to a place."""
    off = place - surface.points[surface.tree.query(place)[1]]
    return off / max(float(np.linalg.norm(off)), 1e-9)
