"""Makers of furniture: chairs, stools, tables, shelves, cabinets, monitors, ladders.

Chairs of wood, plastic and office make, stools and armchairs. The back is at -x.
"""

from itertools import pairwise

import numpy as np

from omomo_core.learning.synthesis.props.prop import Blueprint, GripBar, bar
from omomo_core.learning.synthesis.shapes import SolidPart, beam, box, cylinder, rod

_SEAT_LEG, _CHAIR_LEG = 0.1, 0.4
"""How readily legs are held: hardly, or to lift a light chair high."""
_ALONG_Y = (0.0, 1.0, 0.0)
_CHAIR_SIDES = (0.45, 0.17, 0.21, 0.17)


def wood_chair(rng: np.random.Generator) -> Blueprint:
    """Four legs, a seat and a back of slats, rungs or a board."""
    x, y = rng.uniform(0.19, 0.24), rng.uniform(0.19, 0.25)
    seat, top, t = rng.uniform(0.42, 0.48), rng.uniform(0.76, 1.08), rng.uniform(0.013, 0.022)
    lean = rng.uniform(0.0, 0.12)
    parts = [box((-x, -y, seat - rng.uniform(0.02, 0.06)), (x, y, seat))]
    parts += _legs(rng, x, y, seat, t)
    for sy in (-1, 1):
        at = sy * (y - t)
        parts += beam((-x + t, at, seat), (-x + t - lean, at, top), _ALONG_Y, 2 * t, 2 * t)
    parts += _back(rng, (-x + t, -x + t - lean), y - 2 * t, seat, top)
    if rng.random() < 0.25:
        parts += _arms(rng, x, y, seat)
    bars = [_top_rail(-x + t - lean, y, top)]
    return Blueprint("woodchair", parts, rng.uniform(3.5, 8), bars, _CHAIR_SIDES)


def white_chair(rng: np.random.Generator) -> Blueprint:
    """A light chair of plastic or metal tube: a shell on four splayed legs."""
    x, y, seat = rng.uniform(0.2, 0.24), rng.uniform(0.2, 0.25), rng.uniform(0.41, 0.47)
    top, t = rng.uniform(0.76, 0.92), rng.uniform(0.012, 0.02)
    parts = [box((-x, -y, seat - 0.03), (x, y, seat))]
    points = np.array([[-x + 0.01, seat], [-x - 0.02, seat + 0.12], [-x - 0.06, top]])
    for a, b in pairwise(points):
        parts += beam(
            (a[0], 0, a[1]), (b[0], 0, b[1]), _ALONG_Y, 2 * y * rng.uniform(0.88, 1.0), 0.022
        )
    out = rng.uniform(0.0, 0.05)
    for sx in (-1, 1):
        for sy in (-1, 1):
            foot = (sx * (x - t + out), sy * (y - t + out), 0.0)
            parts += rod(foot, (sx * (x - 0.04), sy * (y - 0.04), seat - 0.03), t, 8, _CHAIR_LEG)
    if rng.random() < 0.45:
        parts += _arms(rng, x, y, seat)
    parts = [p.moved(np.eye(3), (0, 0, -min(q.low[2] for q in parts))) for p in parts]
    bars = [_top_rail(-x - 0.06, y * 0.9, top)]
    return Blueprint("whitechair", parts, rng.uniform(2.2, 5), bars, _CHAIR_SIDES)


def office_chair(rng: np.random.Generator) -> Blueprint:
    """On castors: seat and back of foam on a column and a star of five arms."""
    x, y, seat = rng.uniform(0.22, 0.26), rng.uniform(0.22, 0.27), rng.uniform(0.43, 0.53)
    low, top, reach = (
        seat + rng.uniform(0.06, 0.18),
        rng.uniform(0.88, 1.18),
        rng.uniform(0.27, 0.34),
    )
    parts = [box((-x, -y, seat - 0.07), (x, y, seat))]
    parts.append(cylinder((0, 0), 0.1, seat - 0.07, (0.03, 0.025), 10, _SEAT_LEG))
    for k in range(5):
        angle = 2 * np.pi * (k + rng.uniform()) / 5 if k == 0 else 2 * np.pi * k / 5
        end = (reach * np.cos(angle), reach * np.sin(angle), 0.08)
        parts += rod((0, 0, 0.11), end, 0.02, 6, 0.0)
        parts.append(cylinder((end[0], end[1]), 0.0, 0.06, (0.025, 0.025), 8, 0.0))
    half = y * rng.uniform(0.8, 1.0)
    parts += beam(
        (-x + 0.02, 0, seat - 0.05), (-x - 0.03, 0, low + 0.1), _ALONG_Y, 0.07, 0.02, _SEAT_LEG
    )
    parts += beam(
        (-x - 0.02, 0, low), (-x - rng.uniform(0.04, 0.1), 0, top), _ALONG_Y, 2 * half, 0.05
    )
    if rng.random() < 0.6:
        parts += _arms(rng, x * 0.8, y + 0.03, seat - 0.05)
    bars = [bar("rail", (-x - 0.07, -half, top - 0.02), (-x - 0.07, half, top - 0.02), "push")]
    mass = rng.uniform(7, 16)
    return Blueprint("officechair", parts, mass, bars, (0.55, 0.13, 0.19, 0.13), wheels=True)


def stool(rng: np.random.Generator) -> Blueprint:
    """A seat without a back on three or four legs."""
    height, r = rng.uniform(0.38, 0.78), rng.uniform(0.14, 0.2)
    thick, t, splay = rng.uniform(0.025, 0.06), rng.uniform(0.012, 0.02), rng.uniform(0.0, 0.06)
    if rng.random() < 0.6:
        parts = [cylinder((0, 0), height - thick, height, (r, r), 22)]
    else:
        parts = [box((-r, -r * rng.uniform(0.8, 1.2), height - thick), (r, r, height))]
    number = int(rng.integers(3, 5))
    feet = []
    for k in range(number):
        angle = np.pi / 4 + 2 * np.pi * k / number
        u = np.array([np.cos(angle), np.sin(angle), 0.0])
        foot, top = u * (0.8 * r + splay), u * 0.75 * r + [0, 0, height - thick]
        parts += rod(foot, top, t, 8, _SEAT_LEG)
        feet.append(foot + 0.4 * (top - foot))
    if rng.random() < 0.6:
        for a, b in zip(feet, feet[1:] + feet[:1], strict=True):
            parts += rod(a, b, 0.009, 6, 0.0)
    parts = [p.moved(np.eye(3), (0, 0, -min(q.low[2] for q in parts))) for p in parts]
    return Blueprint("stool", parts, rng.uniform(1.8, 6))


def armchair(rng: np.random.Generator) -> Blueprint:
    """Upholstered: too heavy to lift."""
    x, y, seat = rng.uniform(0.36, 0.45), rng.uniform(0.36, 0.5), rng.uniform(0.38, 0.46)
    arm, top, wide = seat + rng.uniform(0.12, 0.24), rng.uniform(0.72, 1.0), rng.uniform(0.1, 0.16)
    foot = rng.uniform(0.04, 0.14)
    parts = [
        box((-x, -y + wide, foot), (x, y - wide, seat)),
        box((-x, -y, foot), (-x + 0.2, y, top)),
    ]
    for sy in (-1, 1):
        low, high = sorted((sy * y, sy * (y - wide)))
        parts.append(box((-x + 0.2, low, foot), (x, high, arm)))
        for sx in (-1, 1):
            at = np.array([sx * (x - 0.05), sy * (y - 0.05)])
            parts.append(box((*(at - 0.025), 0.0), (*(at + 0.025), foot), 0.0))
    return Blueprint("armchair", parts, rng.uniform(16, 32), sides=(0.4, 0.2, 0.2, 0.2))


def _top_rail(x: float, y: float, top: float) -> GripBar:
    return bar("rail", (x, -y, top - 0.02), (x, y, top - 0.02), "push", "tip", "lift", "one_hand")


def _legs(rng: np.random.Generator, x: float, y: float, seat: float, t: float) -> list[SolidPart]:
    out: list[SolidPart] = []
    for sx in (-1, 1):
        for sy in (-1, 1):
            a, b = sx * (x - t), sy * (y - t)
            out.append(box((a - t, b - t, 0), (a + t, b + t, seat - 0.02), _CHAIR_LEG))
    if rng.random() < 0.5:
        z = rng.uniform(0.12, 0.3)
        for sy in (-1, 1):
            out.append(
                box(
                    (-x + t, sy * (y - t) - 0.01, z),
                    (x - t, sy * (y - t) + 0.01, z + 0.03),
                    _CHAIR_LEG,
                )
            )
        out.append(box((-0.01, -y + t, z), (0.01, y - t, z + 0.03), 0.0))
    return out


def _back(
    rng: np.random.Generator, x: tuple[float, float], y: float, seat: float, top: float
) -> list[SolidPart]:
    """What is between the posts: x at the seat and at the top, half its width, its heights."""

    def at(z: float) -> float:
        return float(np.interp(z, [seat, top], x))

    def board(low: float, high: float, thick: float) -> list[SolidPart]:
        return beam((at(low), 0, low), (at(high), 0, high), _ALONG_Y, 2 * y, thick)

    style = rng.choice(["slats", "rungs", "board"], p=[0.4, 0.35, 0.25])
    rail = rng.uniform(0.04, 0.1)
    if style == "board":
        return board(seat + rng.uniform(0.03, 0.2), top - 0.004, 0.018)
    if style == "rungs":
        levels = np.linspace(seat + rng.uniform(0.1, 0.2), top - rail, int(rng.integers(2, 5)))
        return [p for z in levels for p in board(z, z + rail - 0.004, 0.018)]
    out = board(top - rail, top - 0.004, 0.022)
    number, wide = int(rng.integers(2, 7)), rng.uniform(0.012, 0.03)
    low = seat + rng.choice([0.0, rng.uniform(0.06, 0.14)])
    if low > seat:
        out += board(low - 0.03, low, 0.02)
    for slat in np.linspace(-y, y, number + 2)[1:-1]:
        out += beam((at(low), slat, low), (at(top - rail), slat, top - rail), _ALONG_Y, wide, 0.014)
    return out


def _arms(rng: np.random.Generator, x: float, y: float, seat: float) -> list[SolidPart]:
    z, front = seat + rng.uniform(0.17, 0.24), x * rng.uniform(0.5, 0.95)
    out: list[SolidPart] = []
    for sy in (-1, 1):
        low, high = sorted((sy * (y - 0.015), sy * (y + 0.035)))
        out.append(box((-x - 0.01, low, z), (front, high, z + 0.03)))
        out.append(
            box((front - 0.06, low + 0.01, seat - 0.02), (front - 0.03, high - 0.01, z), 0.3)
        )
    return out


_TABLE_LEG = 0.15
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
                out += beam(foot, top, (0, 1, 0), 2 * thick, 2 * thick, _TABLE_LEG)
            else:
                out += rod(foot, top, thick, 8, _TABLE_LEG)
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
                (sx * x, at, 0),
                (sx * x * (1 - splay), at, under),
                (0, 1, 0),
                2 * t,
                2 * t,
                _TABLE_LEG,
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
