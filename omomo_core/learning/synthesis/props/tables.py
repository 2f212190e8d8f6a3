"""Tables, large and small: tops on four legs, a pedestal, trestles or panels."""

import numpy as np

from omomo_core.learning.synthesis.props.blueprint import Blueprint, bar
from omomo_core.learning.synthesis.shapes import SolidPart, beam, box, cylinder, rod

_LEG = 0.15
"""Grip of a leg: rarely held."""


def large_table(rng: np.random.Generator) -> Blueprint:
    """Dining table, desk or folding table; its long side along y."""
    x, y = rng.uniform(0.3, 0.48), rng.uniform(0.45, 0.9)
    return _table(rng, "largetable", x, y, rng.uniform(0.68, 0.78), rng.uniform(9, 30))


def small_table(rng: np.random.Generator) -> Blueprint:
    """Side table, coffee table or small desk."""
    if rng.random() < 0.25:
        x, y, height = rng.uniform(0.22, 0.3), rng.uniform(0.35, 0.6), rng.uniform(0.35, 0.5)
    else:
        x = rng.uniform(0.16, 0.34)
        y, height = x * rng.uniform(1.0, 1.4), rng.uniform(0.4, 0.75)
    return _table(rng, "smalltable", x, y, height, rng.uniform(3, 10))


def _table(
    rng: np.random.Generator, name: str, x: float, y: float, height: float, mass: float
) -> Blueprint:
    thick = rng.uniform(0.015, 0.045)
    under = height - thick
    round_top = rng.random() < (0.15 if name == "largetable" else 0.3)
    if round_top:
        y = x = min((x + y) / 2, 0.6)
        top = cylinder((0.0, 0.0), under, height, (x, x), 28)
    else:
        top = box((-x, -y, under), (x, y, height))
    style = rng.choice(["four", "pedestal", "trestle", "panel"], p=_styles(round_top, y))
    inset = 0.3 * x if round_top else rng.uniform(0.0, 0.06)
    legs = {"four": _four, "pedestal": _pedestal, "trestle": _trestle, "panel": _panels}[str(style)]
    parts = [top, *legs(rng, x - inset, y - inset, under)]
    if style == "four" and not round_top and rng.random() < 0.5:
        parts += _apron(rng, x - inset, y - inset, under)
    bars = []
    if style == "pedestal" and name == "smalltable" and height > 0.5:
        bars = [bar("pole", (0, 0, 0.25), (0, 0, under - 0.06), "lift", "one_hand")]
    return Blueprint(name, parts, mass, bars, sides=(0.35, 0.15, 0.35, 0.15))


def _styles(round_top: bool, y: float) -> list[float]:
    if round_top:
        return [0.5, 0.5, 0.0, 0.0]
    return [0.65, 0.05, 0.18, 0.12] if y > 0.4 else [0.75, 0.1, 0.05, 0.1]


def _four(rng: np.random.Generator, x: float, y: float, under: float) -> list[SolidPart]:
    thick, splay = rng.uniform(0.015, 0.032), rng.choice([0.0, 0.0, rng.uniform(0.02, 0.07)])
    square = rng.random() < 0.6
    out: list[SolidPart] = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            top = (sx * (x - thick - splay), sy * (y - thick - splay), under)
            foot = (sx * (x - thick), sy * (y - thick), 0.0)
            if square or splay == 0.0:
                out += beam(foot, top, (0, 1, 0), 2 * thick, 2 * thick, _LEG)
            else:
                out += rod(foot, top, thick, 8, _LEG)
    if rng.random() < 0.2:
        z = rng.uniform(0.12, 0.45) * under
        inner = 2.2 * thick + splay
        out.append(box((-x + inner, -y + inner, z), (x - inner, y - inner, z + 0.018)))
    return _grounded(out)


def _apron(rng: np.random.Generator, x: float, y: float, under: float) -> list[SolidPart]:
    deep, t, inset = rng.uniform(0.05, 0.1), 0.02, 0.02
    low, x, y = under - deep, x - inset, y - inset
    return [
        box((-x, -y, low), (-x + t, y, under)),
        box((x - t, -y, low), (x, y, under)),
        box((-x + t, -y, low), (x - t, -y + t, under)),
        box((-x + t, y - t, low), (x - t, y, under)),
    ]


def _pedestal(rng: np.random.Generator, x: float, y: float, under: float) -> list[SolidPart]:
    radius, wide = rng.uniform(0.02, 0.05), min(x, y) * rng.uniform(0.65, 0.95)
    out = [cylinder((0.0, 0.0), 0.03, under, (radius, radius), 14)]
    if rng.random() < 0.6:
        out.append(cylinder((0.0, 0.0), 0.0, 0.03, (wide, wide * 0.95), 24, 0.0))
        return out
    out.append(box((-wide, -0.03, 0), (wide, 0.03, 0.04), 0.0))
    out.append(box((-0.03, -wide, 0), (0.03, wide, 0.04), 0.0))
    return out


def _trestle(rng: np.random.Generator, x: float, y: float, under: float) -> list[SolidPart]:
    """Two end frames: an A or a post on a foot; a bar between them."""
    inner, t, splay = y * rng.uniform(0.75, 0.95), rng.uniform(0.015, 0.03), rng.uniform(0.0, 0.8)
    out: list[SolidPart] = []
    for sy in (-1, 1):
        at = sy * inner
        for sx in (-1, 1):
            out += beam(
                (sx * x, at, 0), (sx * x * (1 - splay), at, under), (0, 1, 0), 2 * t, 2 * t, _LEG
            )
        out.append(box((-x, at - t, 0.0), (x, at + t, 0.035), 0.0))
    middle = rng.uniform(0.2, 0.6) * under
    if splay > 0.6:
        out.append(box((-0.015, -inner, middle), (0.015, inner, middle + 0.05), 0.2))
    return _grounded(out)


def _panels(rng: np.random.Generator, x: float, y: float, under: float) -> list[SolidPart]:
    t = rng.uniform(0.018, 0.035)
    out = [box((-x, -y, 0), (x, -y + t, under)), box((-x, y - t, 0), (x, y, under))]
    if rng.random() < 0.6:
        out.append(box((x - 0.06, -y + t, under * 0.5), (x - 0.045, y - t, under)))
    return out


def _grounded(parts: list[SolidPart]) -> list[SolidPart]:
    """Slanted pieces end a little below the floor: everything raised to stand on it."""
    lift = -min(float(p.low[2]) for p in parts)
    return [p.moved(np.eye(3), (0, 0, lift)) if p.low[2] < 1e-9 else p for p in parts]
