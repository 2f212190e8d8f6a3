"""Makers of what is carried, rolled or swept with: boxes, bins, cases, carts, lamps, mops."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from omomo_core.learning.synthesis.props.prop import BarKind, Blueprint, GripBar, bar
from omomo_core.learning.synthesis.shapes import SolidPart, beam, box, cylinder, rod, shell


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


def suitcase(rng: np.random.Generator) -> Blueprint:
    """Upright; the pull-out handle at its back (-x), grips on top and at one side."""
    size = rng.uniform(0.0, 1.0)
    x, y, z = np.array([0.095, 0.17, 0.46]) + size * np.array([0.06, 0.08, 0.22])
    x, y, z = np.array([x, y, z]) * rng.uniform(0.92, 1.08, 3)
    foot = rng.uniform(0.02, 0.06)
    parts = [box((-x, -y, foot), (x, y, foot + z))]
    for sx in (-1, 1):
        for sy in (-1, 1):
            at = (sx * (x - 0.03), sy * (y - 0.04))
            parts.append(cylinder(at, 0.0, foot, (0.02, 0.02), 8, 0.0))
    top, half, gap = foot + z, rng.uniform(0.05, 0.08), rng.uniform(0.03, 0.045)
    parts += rod((0.0, -half, top + gap), (0.0, half, top + gap), 0.009)
    parts += [
        box((-0.01, s * half - 0.01, top), (0.01, s * half + 0.01, top + gap), 0.0) for s in (-1, 1)
    ]
    bars = [bar("handle", (0, -half + 0.01, top + gap), (0, half - 0.01, top + gap), "one_hand")]
    out = rng.random() < 0.5
    if out:
        high, wide = rng.uniform(0.94, 1.1), rng.uniform(0.07, 0.13)
        for s in (-1, 1):
            parts += rod(
                (-x + 0.02, s * wide, top), (-x + 0.02, s * wide, high - 0.01), 0.008, 6, 0.0
            )
        parts += rod((-x + 0.02, -wide, high), (-x + 0.02, wide, high), 0.014)
        bars.append(
            bar(
                "rail",
                (-x + 0.02, -wide + 0.02, high),
                (-x + 0.02, wide - 0.02, high),
                "push",
                "push",
                "tip",
            )
        )
    sides = (0.6, 0.2, 0.0, 0.2) if out else (0.3, 0.25, 0.2, 0.25)
    return Blueprint("suitcase", parts, rng.uniform(3, 20), bars, sides, wheels=True)


def pushcart(rng: np.random.Generator) -> Blueprint:
    """A platform on wheels with a bow to push it; perhaps loaded, perhaps with more shelves."""
    x, y, deck = rng.uniform(0.3, 0.5), rng.uniform(0.2, 0.32), rng.uniform(0.12, 0.18)
    high, back = rng.uniform(0.84, 1.06), -x - rng.uniform(0.0, 0.15)
    parts = [box((-x, -y, deck - 0.035), (x, y, deck))]
    wide = y * rng.uniform(0.75, 0.97)
    for s in (-1, 1):
        parts += rod((-x + 0.02, s * wide, deck), (back, s * wide, high), 0.014, 8, 0.3)
    parts += rod((back, -wide, high), (back, wide, high), rng.uniform(0.013, 0.018))
    parts += _castors(x - 0.06, y - 0.04, deck - 0.035)
    load = rng.choice(["none", "box", "shelves"], p=[0.35, 0.4, 0.25])
    if load == "box":
        bx, by, bz = rng.uniform([0.4, 0.5, 0.2], [0.85, 0.95, 0.55]) * [x, y, 1.0]
        shift = rng.uniform(-1, 1) * (x - bx) * 0.8 + 0.02
        parts.append(box((shift - bx, -by, deck), (shift + bx, by, deck + bz), 0.2))
    if load == "shelves":
        for z in np.linspace(deck, high - 0.1, 3)[1:]:
            parts.append(box((-x + 0.03, -y, z - 0.03), (x, y, z), 0.3))
        for s in (-1, 1):
            parts.append(
                box(
                    (x - 0.03, s * (y - 0.02) - 0.012, deck),
                    (x, s * (y - 0.02) + 0.012, high - 0.1),
                    0.3,
                )
            )
    bars = [bar("rail", (back, -wide + 0.02, high), (back, wide - 0.02, high), "push")]
    return Blueprint(
        "pushcart", parts, rng.uniform(10, 60), bars, (1.0, 0.0, 0.0, 0.0), wheels=True, whole=False
    )


def hand_truck(rng: np.random.Generator) -> Blueprint:
    """Two wheels, a toe plate and two grips; perhaps with boxes on it."""
    y, high, t = rng.uniform(0.17, 0.23), rng.uniform(1.05, 1.3), 0.014
    parts = [box((0.0, -y, 0.0), (0.26, y, 0.012), 0.0)]
    for s in (-1, 1):
        parts += rod((0.0, s * y, 0.0), (0.0, s * y, high), t, 8)
        parts += rod((-0.1, s * (y + 0.03), 0.11), (-0.1, s * (y + 0.07), 0.11), 0.11, 14, 0.0)
    for z in (0.3, 0.6, 0.9):
        parts += beam((0, -y, z), (0, y, z), (0, 0, 1), 0.04, 0.012, 0.0)
    parts += rod((0, -y, high), (0, y, high), t)
    if rng.random() < 0.6:
        z = 0.012
        for _ in range(int(rng.integers(1, 4))):
            tall = rng.uniform(0.2, 0.35)
            parts.append(
                box((0.02, -y * 1.1, z), (0.02 + rng.uniform(0.2, 0.4), y * 1.1, z + tall), 0.1)
            )
            z += tall
    bars = [bar("rail", (0, -y, high), (0, y, high), "push", "tip")]
    return Blueprint(
        "handtruck", parts, rng.uniform(8, 50), bars, (1.0, 0.0, 0.0, 0.0), wheels=True, whole=False
    )


def _castors(x: float, y: float, under: float) -> list[SolidPart]:
    return [
        cylinder((sx * x, sy * y), 0.0, under, (0.045, 0.04), 10, 0.0)
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]


_HELD = ("lift", "lift", "one_hand", "push", "tip")


def floor_lamp(rng: np.random.Generator) -> Blueprint:
    """A pole on a disc, a slab or three legs, under a shade."""
    height, r = rng.uniform(1.15, 1.8), rng.uniform(0.008, 0.022)
    shade = rng.uniform(0.14, 0.32)
    wide, narrow = sorted(rng.uniform(0.06, 0.22, 2))[::-1]
    parts = _foot(rng, r)
    parts += rod((0, 0, 0.02), (0, 0, height - shade * 0.7), r, 10)
    style = rng.choice(["cone", "bowl", "none"], p=[0.65, 0.25, 0.1])
    if style == "cone":
        parts.append(cylinder((0, 0), height - shade, height, (wide, narrow), 18, 0.0))
    elif style == "bowl":
        parts.append(
            cylinder((0, 0), height - shade * 0.7, height - shade * 0.4, (0.03, wide), 18, 0.0)
        )
    else:
        end = rng.uniform(0.15, 0.35)
        parts += rod((0, 0, height - shade * 0.7), (end, 0, height - 0.1), r * 0.8, 8, 0.0)
        parts.append(cylinder((end, 0.0), height - 0.2, height - 0.1, (0.09, 0.04), 14, 0.0))
    bars = [bar("pole", (0, 0, 0.3), (0, 0, height - shade - 0.08), *_HELD)]
    return Blueprint("floorlamp", parts, rng.uniform(2, 9), bars, whole=False)


def clothes_stand(rng: np.random.Generator) -> Blueprint:
    """A tree with hooks, or a rail between two posts."""
    if rng.random() < 0.5:
        return _rack(rng)
    height, r = rng.uniform(1.55, 1.85), rng.uniform(0.011, 0.024)
    parts = [*_foot(rng, r), *rod((0, 0, 0.02), (0, 0, height), r, 10)]
    for level in height - rng.uniform(0.04, 0.3, int(rng.integers(1, 3))):
        number, turn = int(rng.integers(3, 5)), rng.uniform(0, 1.5)
        for k in range(number):
            angle = turn + 2 * np.pi * k / number
            out = rng.uniform(0.1, 0.18)
            end = (out * np.cos(angle), out * np.sin(angle), level + rng.uniform(0.04, 0.1))
            parts += rod((0, 0, level), end, 0.007, 6, 0.0)
    bars = [bar("pole", (0, 0, 0.35), (0, 0, height - 0.4), *_HELD)]
    return Blueprint("clothesstand", parts, rng.uniform(2.5, 9), bars, whole=False)


def _rack(rng: np.random.Generator) -> Blueprint:
    y, height, r = rng.uniform(0.22, 0.6), rng.uniform(1.3, 1.75), rng.uniform(0.01, 0.016)
    foot, wheels = rng.uniform(0.18, 0.26), rng.random() < 0.5
    base = 0.06 if wheels else r
    parts: list[SolidPart] = []
    for s in (-1, 1):
        parts += rod((0, s * y, base), (0, s * y, height), r, 8)
        parts += rod((-foot, s * y, base), (foot, s * y, base), r, 8, 0.0)
        parts += [
            cylinder((sx * foot, s * y), 0.0, base, (0.02, 0.02), 8, 0.0)
            for sx in (-1, 1)
            if wheels
        ]
    parts += rod((0, -y, height), (0, y, height), r, 8)
    if rng.random() < 0.6:
        parts += rod((0, -y, base + 0.12), (0, y, base + 0.12), r * 0.8, 6, 0.0)
    bars = [bar("pole", (0, s * y, 0.4), (0, s * y, height - 0.15), "push", "tip") for s in (-1, 1)]
    bars.append(bar("rail", (0, -y + 0.04, height), (0, y - 0.04, height), "push", "tip", "lift"))
    return Blueprint("clothesstand", parts, rng.uniform(2.5, 7), bars, wheels=wheels)


def tripod(rng: np.random.Generator) -> Blueprint:
    """Spread, or folded into a bundle that cannot stand."""
    hub, head = rng.uniform(0.75, 1.25), rng.uniform(0.08, 0.3)
    folded = rng.random() < 0.25
    spread = 0.05 if folded else hub * rng.uniform(0.28, 0.45)
    r, near, turn = rng.uniform(0.011, 0.018), 0.035, rng.choice([0.0, np.pi])
    parts = [cylinder((0, 0), hub - 0.06, hub + 0.03, (0.035, 0.045), 10)]
    bars = [bar("pole", (0, 0, hub - 0.05), (0, 0, hub + 0.03), "one_hand", "push")]
    for k in range(3):
        angle = turn + 2 * np.pi * k / 3
        u = np.array([np.cos(angle), np.sin(angle), 0.0])
        foot, top = u * spread, u * near + [0, 0, hub]
        knee = foot + 0.5 * (top - foot)
        parts += rod(foot, knee, r * 0.8, 8, 0.1) + rod(knee, top, r, 8, 0.6)
        a, b = foot + 0.55 * (top - foot), foot + 0.93 * (top - foot)
        bars.append(bar("pole", tuple(a), tuple(b), "lift", "one_hand", "tip"))
    parts += rod((0, 0, hub), (0, 0, hub + head), 0.013, 8)
    parts.append(
        box((-0.05, -0.05, hub + head), (0.07, 0.05, hub + head + rng.uniform(0.05, 0.12)), 0.2)
    )
    parts = [p.moved(np.eye(3), (0, 0, -min(q.low[2] for q in parts))) for p in parts]
    if head > 0.15:
        bars.append(bar("pole", (0, 0, hub + 0.05), (0, 0, hub + head), "one_hand", "lift"))
    return Blueprint("tripod", parts, rng.uniform(1, 5), bars, stands=not folded)


def _foot(rng: np.random.Generator, r: float) -> list[SolidPart]:
    wide = rng.uniform(0.11, 0.18)
    style = rng.choice(["disc", "slab", "legs"], p=[0.5, 0.2, 0.3])
    if style == "disc":
        return [cylinder((0, 0), 0.0, rng.uniform(0.015, 0.04), (wide, wide * 0.95), 22, 0.0)]
    if style == "slab":
        return [box((-wide, -wide * 0.8, 0), (wide, wide * 0.8, 0.025), 0.0)]
    out: list[SolidPart] = []
    number = int(rng.integers(3, 5))
    for k in range(number):
        angle = 2 * np.pi * (k + 0.5) / number
        end = (1.6 * wide * np.cos(angle), 1.6 * wide * np.sin(angle), r)
        out += rod(end, (0, 0, rng.uniform(0.1, 0.3)), r * 0.9, 8, 0.0)
    return [p.moved(np.eye(3), (0, 0, -min(q.low[2] for q in out))) for p in out]


_TOWARD = (1.0, 0.0, 0.0, 0.0)


def mop(rng: np.random.Generator) -> Blueprint:
    """A string mop, a sponge or a flat one."""
    top, parts, pole = _pole(rng, rng.uniform(1.1, 1.45), rng.uniform(0.01, 0.015))
    style = rng.choice(["strings", "flat", "sponge"])
    if style == "strings":
        wide = rng.uniform(0.08, 0.16)
        parts.append(cylinder((0, 0), 0.0, rng.uniform(0.06, 0.16), (wide, 0.035), 16, 0.0))
    elif style == "flat":
        parts.append(box((-0.06, -0.21, 0.0), (0.06, 0.21, 0.03), 0.0))
    else:
        parts.append(box((-0.04, -0.13, 0.0), (0.04, 0.13, 0.07), 0.0))
    return _tool("mop", parts, [pole], rng.uniform(0.6, 1.6), top)


def broom(rng: np.random.Generator) -> Blueprint:
    """Broom, rake or squeegee."""
    top, parts, pole = _pole(rng, rng.uniform(1.15, 1.5), rng.uniform(0.01, 0.014))
    wide, deep = rng.uniform(0.12, 0.3), rng.uniform(0.015, 0.04)
    bristles, back = rng.uniform(0.05, 0.12), rng.uniform(0.02, 0.04)
    parts.append(box((-deep, -wide, 0.0), (deep, wide, bristles), 0.0))
    parts.append(box((-deep, -wide, bristles), (deep, wide, bristles + back), 0.0))
    return _tool("broom", parts, [pole], rng.uniform(0.5, 1.3), top)


def vacuum(rng: np.random.Generator) -> Blueprint:
    """An upright or stick vacuum with its motor low, in the middle or high; or a canister."""
    if rng.random() < 0.2:
        return _canister(rng)
    top, parts, pole = _pole(rng, rng.uniform(1.0, 1.2), rng.uniform(0.014, 0.02))
    deep, wide = rng.uniform(0.09, 0.15), rng.uniform(0.12, 0.16)
    parts.append(box((-deep, -wide, 0.0), (deep, wide, rng.uniform(0.05, 0.09)), 0.0))
    base, end = np.array([0.0, 0.0, 0.05]), np.array(top)
    at, size = rng.choice([0.3, 0.45, 0.78]), rng.uniform(0.05, 0.09)
    long = rng.uniform(0.2, 0.4) if at < 0.7 else 0.16
    u = (end - base) / np.linalg.norm(end - base)
    a = base + u * (at * np.linalg.norm(end - base) - long / 2)
    parts += beam(a, a + u * long, (0, 1, 0), 2 * size, 1.6 * size, 0.2)
    grip = base + u * (np.linalg.norm(end - base) - 0.04)
    kind: BarKind = "pole"
    handle = bar(kind, tuple(grip - u * 0.14), tuple(grip), "tool", "tool", "one_hand")
    return _tool("vacuum", parts, [handle, pole], rng.uniform(2.5, 7), top)


def _canister(rng: np.random.Generator) -> Blueprint:
    x, y, z = rng.uniform([0.16, 0.11, 0.16], [0.24, 0.16, 0.26])
    parts = [
        box((-x, -y, 0.02), (x, y, z)),
        box((-x * 0.5, -y - 0.03, 0), (x * 0.2, y + 0.03, 0.1), 0.0),
    ]
    gap, half = rng.uniform(0.04, 0.06), rng.uniform(0.06, 0.1)
    parts += rod((-half, 0, z + gap), (half, 0, z + gap), 0.012)
    parts += [
        box((s * half - 0.012, -0.012, z), (s * half + 0.012, 0.012, z + gap), 0.0) for s in (-1, 1)
    ]
    handle = bar("handle", (-half + 0.01, 0, z + gap), (half - 0.01, 0, z + gap), "one_hand")
    return Blueprint("vacuum", parts, rng.uniform(4, 8), [handle], wheels=True)


def _pole(
    rng: np.random.Generator, length: float, radius: float
) -> tuple[Float[np.ndarray, " 3"], list[SolidPart], GripBar]:
    """Its upper end, its parts, and the stretch that hands take."""
    rise = np.radians(rng.uniform(42, 72) if rng.random() < 0.75 else rng.uniform(82, 90))
    u = np.array([-np.cos(rise), 0.0, np.sin(rise)])
    foot = np.array([0.0, 0.0, 0.04])
    top = foot + length * u
    a, b = foot + 0.45 * length * u, foot + (length - 0.05) * u
    held = bar("pole", tuple(a), tuple(b), "tool", "tool", "lift", "one_hand")
    return top, rod(foot, top, radius, 8), held


def _tool(
    name: str,
    parts: list[SolidPart],
    bars: list[GripBar],
    mass: float,
    top: Float[np.ndarray, " 3"],
) -> Blueprint:
    """One that stands upright is carried; only a slanted one can sweep."""
    low = min(float(p.low[2]) for p in parts)
    parts = [p.moved(np.eye(3), (0, 0, -low)) for p in parts]
    if top[0] > -0.25:
        bars = [GripBar(b.kind, b.a, b.b, tuple(u for u in b.uses if u != "tool")) for b in bars]
    return Blueprint(name, parts, mass, bars, _TOWARD, stands=False, whole=False)
