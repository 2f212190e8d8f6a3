"""Things held by a pole that stand on a foot: lamps, clothes stands, tripods."""

import numpy as np

from omomo_core.learning.synthesis.props.blueprint import Blueprint, bar
from omomo_core.learning.synthesis.shapes import SolidPart, box, cylinder, rod

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
