"""How hands close around poles, rails and carrying handles."""

import numpy as np
from jaxtyping import Float

from omomo_core.learning.synthesis.props.blueprint import GripBar
from omomo_core.learning.synthesis.props.prop import Grasp, Use
from omomo_core.learning.synthesis.props.rays import RayMesh

_UP = np.array([0.0, 0, 1])
_AHEAD = np.array([1.0, 0, 0])
_LEFT = np.array([0.0, 1, 0])
_THICKEST = 0.06
"""From the axis of a bar to its surface, metres."""
_HIGHEST, _LOWEST = 1.5, 0.3
"""Where poles are taken, metres."""
_HOOKED = ([0.6, 1.1], [0.8, 0.25])
"""How often bars at a height are hooked from below, metres."""
_HANGS = ([0.1, 0.7, 1.05, 1.3, 1.7], [1.35, 0.95, 0.4, -0.15, -1.2])
"""How far forearms slope down to hands at a height: metres, radians."""


def slope(height: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """How far a forearm slopes down to a hand at a height, metres and radians."""
    return np.interp(height, *_HANGS)


def hooked(
    rng: np.random.Generator, height: float
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Palm and fingers of hands that hang in line with their forearms, fingers curled under a thing."""
    drop = float(slope(np.array([height]))[0]) + rng.normal(0.0, 0.2)
    ahead, down = np.cos(drop), np.sin(drop)
    return down * _AHEAD + ahead * _UP, ahead * _AHEAD - down * _UP


def bar_grasps(
    rng: np.random.Generator, mesh: RayMesh, bar: GripBar, one_handed: bool, use: Use
) -> Grasp | None:
    """One way to take a bar, or None where its surface is not found (something covers it)."""
    along = (bar.b - bar.a) / np.linalg.norm(bar.b - bar.a)
    if abs(along[2]) > 0.35 or (bar.kind == "pole" and abs(along[1]) < 0.7):
        where, inward, fingers = _pole(rng, bar, along, one_handed)
    elif abs(along[1]) > 0.7:
        where, inward, fingers = _across(rng, bar, one_handed)
    elif one_handed:
        where, inward, fingers = _lengthwise(rng, bar, along)
    else:
        return None
    palms = _snapped(mesh, where, inward)
    return None if palms is None else Grasp(use, palms, inward, fingers, bar.kind, one_handed)


_Wish = tuple[Float[np.ndarray, "2 3"], Float[np.ndarray, "2 3"], Float[np.ndarray, " 3"]]


def _pole(
    rng: np.random.Generator, bar: GripBar, along: Float[np.ndarray, " 3"], one: bool
) -> _Wish:
    """A pole between the hands, one above the other; or in one fist."""
    low, high = sorted((float(bar.a[2]), float(bar.b[2])))
    low, high = max(low, min(_LOWEST, high)), max(min(high, _HIGHEST), low)
    middle = (
        np.clip(rng.normal(0.55, 0.2), 0.05, 0.95) if high - low > 0.5 else rng.uniform(0.2, 0.8)
    )
    z = np.repeat(low + (high - low) * middle, 2)
    if not one:
        gap = min(rng.uniform(0.14, 0.45), high - low)
        z = np.clip(z, low + gap / 2, high - gap / 2) + np.array([0.5, -0.5]) * gap
        z = z if rng.random() < 0.5 else z[::-1]
    where = bar.a + ((z - bar.a[2]) / (bar.b[2] - bar.a[2]))[:, None] * (bar.b - bar.a)
    roll = rng.uniform(-0.3, 0.6)
    inward = np.stack([-_LEFT, _LEFT]) * np.cos(roll) + _AHEAD * np.sin(roll)
    fingers = _flat(_AHEAD, along)
    return where, np.stack([_flat(i, along) for i in inward]), fingers


def _across(rng: np.random.Generator, bar: GripBar, one: bool) -> _Wish:
    """A bar from left to right: from above, from behind, or from below."""
    middle, half = (bar.a + bar.b) / 2, abs(float(bar.b[1] - bar.a[1])) / 2
    apart = min(max(half - 0.04, 0.0), rng.uniform(0.05, 0.28)) if not one else 0.0
    along = (bar.b - bar.a) / (bar.b - bar.a)[1]
    shift = 0.0 if not one else rng.uniform(-0.6, 0.6) * max(half - 0.05, 0.0)
    where = middle + np.array([shift + apart, shift - apart])[:, None] * along
    if bar.kind == "handle":
        # The hand hangs behind its knuckles, palm to the back: as one carries things in front.
        return where, np.stack([-_AHEAD, -_AHEAD]), -_UP
    if rng.random() < np.interp(middle[2], *_HOOKED):
        inward, fingers = hooked(rng, float(middle[2]))
        return where, np.stack([inward, inward]), fingers
    tilt = rng.uniform(0.3, 1.4)
    inward = np.cos(tilt) * _AHEAD - np.sin(tilt) * _UP
    return where, np.stack([inward, inward]), np.sin(tilt) * _AHEAD + np.cos(tilt) * _UP


def _lengthwise(rng: np.random.Generator, bar: GripBar, along: Float[np.ndarray, " 3"]) -> _Wish:
    """A bar that points away, in a hand that hangs beside the body."""
    reach = np.clip(rng.normal(0.5, 0.12), 0.2, 0.8)
    where = bar.a + reach * (bar.b - bar.a)
    inward = np.stack([_flat(-_LEFT, along), _flat(_LEFT, along)])
    return np.stack([where, where]), inward, -_UP


def _flat(v: Float[np.ndarray, " 3"], normal: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """The part of a vector across a direction, unit length."""
    across = v - normal * (v @ normal)
    return across / np.linalg.norm(across)


def _snapped(
    mesh: RayMesh, where: Float[np.ndarray, "2 3"], inward: Float[np.ndarray, "2 3"]
) -> Float[np.ndarray, "2 3"] | None:
    """From points on the axis out to the surface."""
    hits = mesh.cast(where - _THICKEST * inward, inward)
    found = (hits.distance < _THICKEST + 0.002) & ((hits.normals * inward).sum(-1) < -0.4)
    return hits.points if found.all() else None
