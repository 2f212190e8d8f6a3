"""Procedural things to carry and push, and where hands can hold them.

A prop stands on z = 0 at the origin of its own frame; a person who handles it stands at -x and looks
along +x, with +y to the left. Metres.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.data.synthesis.shapes import Part, box, cylinder

Use = Literal["lift", "push", "one_hand"]


@dataclass(frozen=True)
class Grasp:
    """Where the palms lie; index 0 is left, 1 right."""

    use: Use
    points: Float[np.ndarray, "2 3"]
    """On the surface, prop frame."""
    inward: Float[np.ndarray, "2 3"]
    """From the palm into the surface, unit length."""
    fingers: Float[np.ndarray, " 3"] | None = None
    """Where the fingers point; None lets them follow the forearm."""


@dataclass(frozen=True)
class Prop:
    """A thing with its possible grasps."""

    name: str
    parts: list[Part]
    grasps: list[Grasp]

    @property
    def low(self) -> Float[np.ndarray, " 3"]:
        """Lower corner of the bounding box."""
        return np.min([p.low for p in self.parts], axis=0)

    @property
    def high(self) -> Float[np.ndarray, " 3"]:
        """Upper corner of the bounding box."""
        return np.max([p.high for p in self.parts], axis=0)


_LEFT, _UP, _AHEAD = np.array([0.0, 1, 0]), np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
WIDEST_HOLD = 0.72
"""Between the palms, metres."""


def make_prop(rng: np.random.Generator, use: Use) -> Prop:
    """A random prop that can be used in this way.

    Args:
        rng: source of all randomness.
        use: lifted with two hands, pushed along the floor, or carried in one hand.
    """
    while True:
        names, weights = zip(*_WEIGHTS[use].items(), strict=True)
        name = str(rng.choice(names, p=np.array(weights) / sum(weights)))
        prop = _MAKERS[name](rng)
        if any(g.use == use for g in prop.grasps):
            return prop


def _sides(
    rng: np.random.Generator, low: Float[np.ndarray, " 3"], high: Float[np.ndarray, " 3"],
    heights: tuple[float, float] = (0.2, 0.75),
) -> list[Grasp]:  # fmt: skip
    """Palms on the left and right face of a box, not too deep in."""
    if high[1] - low[1] > WIDEST_HOLD:
        return []
    depth = high[0] - low[0]
    x = low[0] + min(depth * rng.uniform(0.3, 0.6), 0.28)
    z = low[2] + (high[2] - low[2]) * rng.uniform(*heights)
    points = np.array([[x, high[1], z], [x, low[1], z]])
    return [Grasp("lift", points, np.stack([-_LEFT, _LEFT]))]


def _pushes(
    rng: np.random.Generator, low: Float[np.ndarray, " 3"], high: Float[np.ndarray, " 3"]
) -> list[Grasp]:
    """Palms flat on the near face, or on top near the edge."""
    half = (high[1] - low[1]) / 2
    y = min(half * rng.uniform(0.5, 0.85), rng.uniform(0.16, 0.3))
    middle = (high[1] + low[1]) / 2
    out: list[Grasp] = []
    reachable = min(high[2] - 0.06, rng.uniform(0.8, 1.15))
    if reachable > max(0.62, low[2] + 0.02):
        points = np.array([[low[0], middle + y, reachable], [low[0], middle - y, reachable]])
        # The heel of the hand pushes: a wrist does not bend back by a right angle.
        tilt = rng.uniform(0.4, 0.75)
        inward = _AHEAD * np.cos(tilt) - _UP * np.sin(tilt)
        out.append(Grasp("push", points, np.stack([inward, inward]), fingers=_UP))
    if 0.5 < high[2] < 1.1:
        x = low[0] + min(rng.uniform(0.04, 0.08), (high[0] - low[0]) / 2)
        points = np.array([[x, middle + y, high[2]], [x, middle - y, high[2]]])
        out.append(Grasp("push", points, np.stack([-_UP, -_UP]), fingers=_AHEAD))
    if high[1] - low[1] < 0.6 and 0.55 < high[2] < 1.25:
        side = _sides(rng, low, high, (0.8, 0.92))
        out += [Grasp("push", g.points, g.inward) for g in side if g.points[0, 2] > 0.5]
    return out


def _top_handle(x: float, y: float, z: float) -> Grasp:
    """A handle on top held by either hand at the side of the body."""
    point = np.array([x, y, z])
    return Grasp("one_hand", np.stack([point, point]), np.stack([-_LEFT, _LEFT]), fingers=-_UP)


def _carton(rng: np.random.Generator) -> Prop:
    kind = rng.choice(["cube", "flat", "tall", "thin", "any"])
    sizes = {
        "cube": np.full(3, rng.uniform(0.18, 0.6)) * rng.uniform(0.9, 1.1, 3),
        "flat": np.array([rng.uniform(0.25, 0.6), rng.uniform(0.3, 0.7), rng.uniform(0.06, 0.2)]),
        "tall": np.array([rng.uniform(0.2, 0.5), rng.uniform(0.2, 0.5), rng.uniform(0.6, 1.1)]),
        "thin": np.array([rng.uniform(0.04, 0.15), rng.uniform(0.3, 0.7), rng.uniform(0.3, 0.9)]),
        "any": rng.uniform([0.15, 0.15, 0.15], [0.8, 1.0, 0.9]),
    }
    x, y, z = sizes[str(kind)] / [2, 2, 1]
    part = box(rng, (-x, -y, 0.0), (x, y, z))
    grasps = _sides(rng, part.low, part.high) + _pushes(rng, part.low, part.high)
    return Prop(f"box_{kind}", [part], grasps)


def _crate(rng: np.random.Generator) -> Prop:
    x, y, z = rng.uniform([0.15, 0.16, 0.15], [0.3, 0.34, 0.4])
    t = 0.015
    parts = [
        box(rng, (-x, -y, 0.0), (x, y, t)),
        box(rng, (-x, -y, t), (-x + t, y, z)),
        box(rng, (x - t, -y, t), (x, y, z)),
        box(rng, (-x + t, -y, t), (x - t, -y + t, z)),
        box(rng, (-x + t, y - t, t), (x - t, y, z)),
    ]
    low, high = np.array([-x, -y, 0.0]), np.array([x, y, z])
    return Prop("crate", parts, _sides(rng, low, high, (0.7, 0.9)))


def _legs(rng: np.random.Generator, x: float, y: float, top: float, thick: float) -> list[Part]:
    return [
        box(rng, (cx - thick, cy - thick, 0.0), (cx + thick, cy + thick, top))
        for cx in (-x + thick, x - thick)
        for cy in (-y + thick, y - thick)
    ]


def _chair(rng: np.random.Generator) -> Prop:
    """Back toward the person or away from them."""
    x, y = rng.uniform(0.19, 0.25), rng.uniform(0.19, 0.25)
    seat, top = rng.uniform(0.4, 0.48), rng.uniform(0.78, 1.05)
    near = rng.random() < 0.6
    back = (-x, -x + 0.03) if near else (x - 0.03, x)
    plate = box(rng, (-x, -y, seat - 0.04), (x, y, seat))
    rest = box(rng, (back[0], -y, seat), (back[1], y, top))
    parts = [plate, rest, *_legs(rng, x, y, seat - 0.04, 0.018)]
    grasps = _sides(rng, plate.low, plate.high)
    grasps += [Grasp("lift", g.points, g.inward) for g in _sides(rng, rest.low, rest.high)]
    if near:
        grasps += _pushes(rng, rest.low, rest.high)
    return Prop("chair", parts, grasps)


def _stool(rng: np.random.Generator) -> Prop:
    height, radius = rng.uniform(0.4, 0.75), rng.uniform(0.15, 0.21)
    seat = cylinder(rng, (0.0, 0.0), height - 0.05, height, (radius, radius))
    parts = [seat, *_legs(rng, radius * 0.7, radius * 0.7, height - 0.05, 0.015)]
    points = np.array([[0, radius, height - 0.025], [0, -radius, height - 0.025]])
    return Prop("stool", parts, [Grasp("lift", points, np.stack([-_LEFT, _LEFT]))])


def _table(rng: np.random.Generator) -> Prop:
    x, y = rng.uniform(0.2, 0.5), rng.uniform(0.22, 0.6)
    height = rng.uniform(0.4, 0.78)
    top = box(rng, (-x, -y, height - 0.035), (x, y, height))
    parts = [top, *_legs(rng, x, y, height - 0.035, 0.022)]
    grasps = _sides(rng, top.low, top.high) + _pushes(rng, top.low, top.high)
    return Prop("table", parts, grasps)


def _suitcase(rng: np.random.Generator) -> Prop:
    x, y, z = rng.uniform([0.16, 0.09, 0.4], [0.27, 0.14, 0.6])
    body = box(rng, (-x, -y, 0.0), (x, y, z))
    bar = box(rng, (-0.08, -0.012, z + 0.035), (0.08, 0.012, z + 0.055))
    posts = [
        box(rng, (sx * 0.07 - 0.01, -0.01, z), (sx * 0.07 + 0.01, 0.01, z + 0.035))
        for sx in (-1, 1)
    ]
    grasps = [_top_handle(0.0, 0.0, z + 0.045), *_sides(rng, body.low, body.high)]
    return Prop("suitcase", [body, bar, *posts], grasps)


def _bucket(rng: np.random.Generator) -> Prop:
    """Bin, drum or bucket, with a bow to hold it by."""
    height, radius = rng.uniform(0.25, 0.75), rng.uniform(0.11, 0.24)
    wall = cylinder(rng, (0.0, 0.0), 0.0, height, (radius * rng.uniform(0.8, 1.0), radius))
    z = height * rng.uniform(0.5, 0.85)
    points = np.array([[0, radius, z], [0, -radius, z]])
    grasps = [Grasp("lift", points, np.stack([-_LEFT, _LEFT]))]
    parts = [wall]
    if height < 0.45:
        bow = height + radius * 0.8
        parts += [box(rng, (-0.01, -0.06, bow - 0.01), (0.01, 0.06, bow + 0.01))]
        parts += [
            box(rng, (-0.006, s * radius - 0.006, height), (0.006, s * radius + 0.006, bow))
            for s in (-1, 1)
        ]
        grasps.append(_top_handle(0.0, 0.0, bow))
    return Prop("bin", parts, grasps)


def _lamp(rng: np.random.Generator) -> Prop:
    """A pole on a foot, held with one hand above the other."""
    height, thick = rng.uniform(1.0, 1.7), rng.uniform(0.012, 0.025)
    wide = rng.uniform(0.12, 0.17)
    foot = cylinder(rng, (0.0, 0.0), 0.0, 0.03, (wide, wide))
    pole = cylinder(rng, (0.0, 0.0), 0.03, height, (thick, thick))
    parts = [foot, pole]
    if rng.random() < 0.6:
        parts.append(cylinder(rng, (0.0, 0.0), height - 0.2, height, (0.17, 0.1)))
    low = height * rng.uniform(0.4, 0.55)
    gap = rng.uniform(0.18, 0.3)
    upper_left = rng.random() < 0.5
    z = np.array([low + gap, low] if upper_left else [low, low + gap])
    points = np.array([[0, thick, z[0]], [0, -thick, z[1]]])
    return Prop("lamp", parts, [Grasp("lift", points, np.stack([-_LEFT, _LEFT]), fingers=_AHEAD)])


def _monitor(rng: np.random.Generator) -> Prop:
    y, z, lift = rng.uniform(0.22, 0.34), rng.uniform(0.28, 0.42), rng.uniform(0.08, 0.14)
    panel = box(rng, (-0.02, -y, lift), (0.02, y, lift + z))
    parts = [
        panel,
        box(rng, (-0.1, -0.12, 0.0), (0.1, 0.12, 0.015)),
        box(rng, (0.02, -0.03, 0.015), (0.04, 0.03, lift + z / 2)),
    ]
    return Prop("monitor", parts, _sides(rng, panel.low, panel.high))


_MAKERS: dict[str, Callable[[np.random.Generator], Prop]] = {
    "carton": _carton,
    "crate": _crate,
    "chair": _chair,
    "stool": _stool,
    "table": _table,
    "suitcase": _suitcase,
    "bucket": _bucket,
    "lamp": _lamp,
    "monitor": _monitor,
}
_WEIGHTS: dict[Use, dict[str, float]] = {
    "lift": {
        "carton": 6, "crate": 1.5, "chair": 2, "stool": 1, "table": 1.2, "suitcase": 0.8,
        "bucket": 1, "lamp": 1, "monitor": 1,
    },
    "push": {"carton": 6, "chair": 1.5, "table": 2},
    "one_hand": {"suitcase": 3, "bucket": 2},
}  # fmt: skip
