"""Mops, brooms, vacuums: a head on the floor at the end of a pole that slants toward the person."""

import numpy as np
from jaxtyping import Float

from omomo_core.learning.synthesis.props.blueprint import BarKind, Blueprint, GripBar, bar
from omomo_core.learning.synthesis.shapes import SolidPart, beam, box, cylinder, rod

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
