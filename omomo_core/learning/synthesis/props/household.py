"""Monitors, shelves, cabinets and ladders."""

import numpy as np

from omomo_core.learning.synthesis.props.blueprint import Blueprint, bar
from omomo_core.learning.synthesis.shapes import SolidPart, beam, box, cylinder


def monitor(rng: np.random.Generator) -> Blueprint:
    """A panel on a stand; its face toward +x."""
    y, tall = rng.uniform(0.22, 0.36), rng.uniform(0.26, 0.42)
    lift, thick = rng.uniform(0.06, 0.2), rng.uniform(0.01, 0.03)
    parts = [box((-thick, -y, lift), (thick, y, lift + tall))]
    deep, wide = rng.uniform(0.08, 0.12), rng.uniform(0.09, 0.16)
    style = rng.choice(["plate", "disc", "feet"], p=[0.5, 0.25, 0.25])
    if style == "plate":
        parts.append(box((-deep, -wide, 0.0), (deep, wide, 0.015), 0.3))
    elif style == "disc":
        parts.append(cylinder((0.0, 0.0), 0.0, 0.018, (wide, wide), 18, 0.3))
    if style == "feet":
        for s in (-1, 1):
            at = s * y * 0.7
            parts.append(box((-deep, at - 0.015, 0.0), (deep, at + 0.015, 0.02), 0.0))
            parts.append(box((-0.012, at - 0.012, 0.02), (0.012, at + 0.012, lift), 0.0))
    else:
        parts.append(box((-thick - 0.035, -0.035, 0.012), (-thick, 0.035, lift + tall * 0.55), 0.2))
    return Blueprint("monitor", parts, rng.uniform(2, 8), sides=(0.45, 0.05, 0.45, 0.05))


def shelf(rng: np.random.Generator) -> Blueprint:
    """An open bookcase; its boards seen from +x."""
    x, y, z = rng.uniform(0.12, 0.2), rng.uniform(0.2, 0.5), rng.uniform(0.55, 1.7)
    t = rng.uniform(0.014, 0.025)
    parts = [box((-x, s * y - t / 2, 0), (x, s * y + t / 2, z)) for s in (-1, 1)]
    inner = y - t / 2
    for level in np.linspace(rng.uniform(0.02, 0.1), z - t, int(rng.integers(2, 6))):
        parts.append(box((-x, -inner, level), (x, inner, level + t)))
    if rng.random() < 0.6:
        parts.append(box((-x, -inner, 0.03), (-x + 0.008, inner, z - t)))
    mass = 4 + 14 * z * y + rng.uniform(0, 6)
    return Blueprint("shelf", parts, mass, sides=(0.15, 0.35, 0.15, 0.35))


def cabinet(rng: np.random.Generator) -> Blueprint:
    """Chest of drawers, cupboard or small fridge on a base or short feet."""
    x, y, z = rng.uniform([0.18, 0.2, 0.45], [0.3, 0.5, 1.25])
    foot, lip = rng.choice([0.0, rng.uniform(0.05, 0.18)]), rng.choice([0.0, 0.015])
    parts = [box((-x, -y, foot), (x, y, z - 0.02))]
    parts.append(box((-x - lip, -y - lip, z - 0.02), (x + lip, y + lip, z)))
    if foot:
        for sx in (-1, 1):
            for sy in (-1, 1):
                at = np.array([sx * (x - 0.04), sy * (y - 0.04)])
                parts.append(box((*(at - 0.018), 0.0), (*(at + 0.018), foot), 0.0))
    return Blueprint("cabinet", parts, 8 + 60 * x * y * z * rng.uniform(1, 3))


def ladder(rng: np.random.Generator) -> Blueprint:
    """A step ladder set up, folded, or a straight one."""
    height, y = rng.uniform(0.9, 1.75), rng.uniform(0.18, 0.25)
    open_by = float(rng.choice([0.03, rng.uniform(0.25, 0.5)]))
    parts: list[SolidPart] = []
    rungs = round(height / 0.27)
    for s in (-1, 1):
        parts += beam((-open_by, s * y, 0), (-0.012, s * y, height), (0, 1, 0), 0.022, 0.045)
        parts += beam((open_by, s * y, 0), (0.012, s * y, height - 0.03), (0, 1, 0), 0.02, 0.03)
    for k in range(1, rungs):
        at = -open_by + (open_by - 0.012) * k / rungs
        z = height * k / rungs
        parts.append(box((at - 0.035, -y, z - 0.012), (at + 0.035, y, z + 0.012), 0.3))
    parts.append(box((-0.1, -y - 0.01, height - 0.02), (0.1, y + 0.01, height + 0.01), 0.5))
    parts = [p.moved(np.eye(3), (0, 0, -min(q.low[2] for q in parts))) for p in parts]
    uses = ("lift", "lift", "one_hand") if open_by < 0.1 else ("push", "tip", "one_hand")
    low, high = 0.3 * height, 0.85 * height
    bars = [
        bar(
            "pole",
            (-open_by * 0.7 - 0.004, s * y, low),
            (-open_by * 0.15 - 0.01, s * y, high),
            *uses,
        )
        for s in (-1, 1)
    ]
    sides = (0.4, 0.2, 0.2, 0.2)
    return Blueprint("ladder", parts, 2 + 4 * height, bars, sides, stands=open_by > 0.1)
