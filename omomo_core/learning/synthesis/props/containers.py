"""Boxes, crates, bins, buckets and baskets."""

from itertools import pairwise

import numpy as np

from omomo_core.learning.synthesis.props.blueprint import Blueprint, GripBar, bar
from omomo_core.learning.synthesis.shapes import SolidPart, box, cylinder, rod, shell


def small_box(rng: np.random.Generator) -> Blueprint:
    """A carton for one person, or an appliance of that size."""
    x, y, z = rng.uniform(0.14, 0.42, 3)
    return _carton(rng, "smallbox", x, y, z * rng.uniform(0.6, 1.0), rng.uniform(0.5, 6))


def large_box(rng: np.random.Generator) -> Blueprint:
    """A moving box and larger; also tall ones and flat ones (a framed picture, a packed screen)."""
    kind = rng.choice(["any", "cube", "tall", "thin"], p=[0.4, 0.25, 0.2, 0.15])
    sizes = {
        "any": rng.uniform([0.3, 0.3, 0.25], [0.7, 0.9, 0.7]),
        "cube": rng.uniform(0.38, 0.65) * rng.uniform(0.9, 1.1, 3),
        "tall": rng.uniform([0.28, 0.3, 0.65], [0.5, 0.6, 1.2]),
        "thin": rng.uniform([0.05, 0.45, 0.4], [0.16, 0.9, 0.9]),
    }
    x, y, z = sizes[str(kind)]
    return _carton(rng, "largebox", x, y, z, rng.uniform(2, 20))


def _carton(
    rng: np.random.Generator, name: str, x: float, y: float, z: float, mass: float
) -> Blueprint:
    x, y = x / 2, y / 2
    parts = [box((-x, -y, 0), (x, y, z))]
    if rng.random() < 0.15 and x > 0.12:
        # Flaps that stand open.
        flap, t = min(rng.uniform(0.06, 0.2), x), 0.005
        parts += [box((sx * x - t, -y, z), (sx * x + t, y, z + flap), 0.1) for sx in (-1, 1)]
    return Blueprint(name, parts, mass)


def plastic_box(rng: np.random.Generator) -> Blueprint:
    """An open crate with a lip, or a storage box under a lid."""
    x, y, z = rng.uniform([0.14, 0.15, 0.12], [0.3, 0.3, 0.38])
    t, lip, lip_height = 0.012, rng.uniform(0.004, 0.02), rng.uniform(0.015, 0.03)
    parts = [
        box((-x, -y, 0), (x, y, t)),
        box((-x, -y, t), (-x + t, y, z)),
        box((x - t, -y, t), (x, y, z)),
        box((-x + t, -y, t), (x - t, -y + t, z)),
        box((-x + t, y - t, t), (x - t, y, z)),
    ]
    if rng.random() < 0.3:
        return Blueprint(
            "plasticbox",
            [*parts, box((-x - lip, -y - lip, z), (x + lip, y + lip, z + 0.02))],
            rng.uniform(1, 8),
        )
    low = z - lip_height
    parts += [box((sx * x - lip, -y - lip, low), (sx * x + lip, y + lip, z)) for sx in (-1, 1)]
    parts += [box((-x, sy * y - lip, low), (x, sy * y + lip, z)) for sy in (-1, 1)]
    return Blueprint("plasticbox", parts, rng.uniform(0.8, 10), vessel=True)


def trash_can(rng: np.random.Generator) -> Blueprint:
    """Round or square, open or lidded; the tall one has wheels and a grip at its back."""
    style = rng.choice(["round", "square", "lid", "wheelie"], p=[0.35, 0.25, 0.25, 0.15])
    height = rng.uniform(0.26, 0.72)
    r = height * rng.uniform(0.26, 0.42)
    taper = rng.uniform(0.72, 1.0)
    if style == "wheelie":
        return _wheelie(rng)
    if style == "square":
        x, y, t = r, r * rng.uniform(0.7, 1.3), 0.01
        parts = [
            box((-x, -y, 0), (x, y, t)), box((-x, -y, t), (-x + t, y, height)),
            box((x - t, -y, t), (x, y, height)), box((-x + t, -y, t), (x - t, -y + t, height)),
            box((-x + t, y - t, t), (x - t, y, height)),
        ]  # fmt: skip
        return Blueprint("trashcan", parts, rng.uniform(0.8, 4), vessel=True)
    if style == "round":
        parts = [shell(0.0, height, (r * taper, r), 0.008, 22)]
        return Blueprint("trashcan", parts, rng.uniform(0.6, 4), vessel=True)
    dome = rng.uniform(0.02, 0.14)
    parts = [
        cylinder((0, 0), 0.0, height, (r * taper, r), 22),
        cylinder((0, 0), height, height + dome, (r * 1.02, r * rng.uniform(0.4, 0.95)), 22),
    ]
    return Blueprint("trashcan", parts, rng.uniform(1.2, 6))


def _wheelie(rng: np.random.Generator) -> Blueprint:
    x, y, z = rng.uniform(0.22, 0.28), rng.uniform(0.22, 0.28), rng.uniform(0.88, 1.05)
    parts = [
        box((-x, -y, 0.1), (x, y, z)),
        box((-x - 0.01, -y - 0.01, z), (x + 0.03, y + 0.01, z + 0.06)),
        box((0.0, -y, 0.0), (x, y, 0.1), 0.0),
    ]
    parts += rod((-x - 0.07, -y * 0.8, z - 0.03), (-x - 0.07, y * 0.8, z - 0.03), 0.014)
    for sy in (-1, 1):
        parts.append(
            box(
                (-x - 0.07, sy * y * 0.8 - 0.01, z - 0.05), (-x, sy * y * 0.8 + 0.01, z - 0.02), 0.0
            )
        )
        parts += rod((-x, sy * (y - 0.05), 0.1), (-x, sy * y, 0.1), 0.1, 14, 0.0)
    bars = [
        bar(
            "rail", (-x - 0.07, -y * 0.75, z - 0.03), (-x - 0.07, y * 0.75, z - 0.03), "push", "tip"
        )
    ]
    return Blueprint(
        "trashcan", parts, rng.uniform(9, 35), bars, (0.8, 0.08, 0.04, 0.08), wheels=True
    )


def bucket(rng: np.random.Generator) -> Blueprint:
    """With its bow up or down."""
    height, r = rng.uniform(0.22, 0.36), rng.uniform(0.12, 0.17)
    parts = [shell(0.0, height, (r * rng.uniform(0.7, 0.9), r), 0.006, 22)]
    bars: list[GripBar] = []
    if rng.random() < 0.75:
        bow, handle = _bow(r, height, r * rng.uniform(0.75, 1.0), 0.008)
        parts, bars = parts + bow, [handle]
    return Blueprint("bucket", parts, rng.uniform(0.6, 9), bars, vessel=not bars)


def basket(rng: np.random.Generator) -> Blueprint:
    """A shopping basket with a bow, or a laundry basket without."""
    if rng.random() < 0.5:
        height, r = rng.uniform(0.28, 0.6), rng.uniform(0.18, 0.28)
        parts = [shell(0.0, height, (r * rng.uniform(0.75, 1.0), r), 0.012, 22)]
        return Blueprint("basket", parts, rng.uniform(1, 7), vessel=True)
    x, y, z, t = rng.uniform(0.17, 0.24), rng.uniform(0.12, 0.16), rng.uniform(0.16, 0.26), 0.012
    parts = [
        box((-x, -y, 0), (x, y, t)), box((-x, -y, t), (-x + t, y, z)),
        box((x - t, -y, t), (x, y, z)), box((-x + t, -y, t), (x - t, -y + t, z)),
        box((-x + t, y - t, t), (x - t, y, z)),
    ]  # fmt: skip
    bow, handle = _bow(y, z, rng.uniform(0.12, 0.2), 0.011)
    # The bow spans the short way: the hand hangs along it when the long side faces the person.
    return Blueprint("basket", parts + bow, rng.uniform(1, 8), [handle])


def toolbox(rng: np.random.Generator) -> Blueprint:
    """Toolbox, cool box or case with a grip on top."""
    x, y, z = rng.uniform([0.16, 0.07, 0.14], [0.3, 0.14, 0.34])
    gap, r, half = rng.uniform(0.035, 0.06), rng.uniform(0.008, 0.014), rng.uniform(0.06, 0.1)
    parts = [box((-x, -y, 0), (x, y, z)), *rod((-half, 0, z + gap), (half, 0, z + gap), r)]
    parts += [
        box((sx * half - 0.01, -0.01, z), (sx * half + 0.01, 0.01, z + gap), 0.0) for sx in (-1, 1)
    ]
    handle = bar("handle", (-half + 0.01, 0, z + gap), (half - 0.01, 0, z + gap), "one_hand")
    return Blueprint("toolbox", parts, rng.uniform(2, 10), [handle])


def _bow(half: float, rim: float, rise: float, radius: float) -> tuple[list[SolidPart], GripBar]:
    """A raised handle across a vessel, along y."""
    angles = np.linspace(0.0, np.pi, 8)
    path = np.stack([0 * angles, half * np.cos(angles), rim + rise * np.sin(angles)], axis=1)
    parts = [p for a, b in pairwise(path) for p in rod(a, b, radius, 6, 0.0)]
    a, b = path[3], path[4]
    return parts, bar("handle", (a[0], a[1], a[2]), (b[0], b[1], b[2]), "one_hand")
