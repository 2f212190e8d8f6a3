"""Suitcases and carts: things with wheels and grips to roll them by."""

import numpy as np

from omomo_core.learning.synthesis.props.blueprint import Blueprint, bar
from omomo_core.learning.synthesis.shapes import SolidPart, beam, box, cylinder, rod


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
