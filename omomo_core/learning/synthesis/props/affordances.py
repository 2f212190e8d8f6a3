"""Grasps of a prop: candidates on its surface, kept where hands and forearms have room."""

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.learning.synthesis.base_motion import about_z
from omomo_core.learning.synthesis.props.grasp_surfaces import (
    Palms,
    RayMesh,
    bar_grasps,
    edges,
    faces,
    hooked,
    opposed,
    overhangs,
    sides,
    unders,
)
from omomo_core.learning.synthesis.props.prop import Blueprint, Grasp, Kind, Prop, Use
from omomo_core.learning.synthesis.shapes import joined

WIDEST_HOLD = 0.85
"""Between the palms, metres."""
_NARROWEST_HOLD = 0.1
_HEAVIEST_LIFT = 22.0
"""Kilograms that one person lifts."""
_HEAVIEST_HAND = 10.0
_MOST_LEVER = 12.0
"""Kilograms times metres of depth that one person lifts by the near edge: about 60 N m."""
_HIGHEST = 1.75
_LOWEST_PUSH = 0.45
"""Nobody pushes a thing lower, unless the upper half of the thing is lower, metres."""
_LOWEST_EDGE = 0.2
"""Least height of a top near whose edge the palms lie to push, metres."""
_TRIES = 9
"""Attempts at grasps on bars for each use, shared among the bars."""
_UP, _AHEAD = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])

_HAND_THICKNESS = 0.04
_HAND_REACH = 0.035
"""Half the width of a hand, metres."""
_FOREARM = 0.22
"""Length of the forearm behind the hand that nothing may touch, metres."""
_ELBOW_BEHIND = 0.12


def find_grasps(rng: np.random.Generator, plan: Blueprint) -> list[Grasp]:
    """Return grasps of a prop that stands in front of a person at -x."""
    vertices, triangles = joined(plan.parts)
    mesh = RayMesh(vertices, triangles)
    grip = np.repeat([p.grip for p in plan.parts], [len(p.faces) for p in plan.parts])
    found = _on_bars(rng, mesh, plan)
    if plan.whole:
        found += _on_sides(rng, mesh, plan, grip)
        found += _on_near_side(rng, mesh, plan, grip)
    return [g for g in _with_room(mesh, found) if g.points[:, 2].max() < _HIGHEST]


def side_grasp(prop: Prop, turn: float, height: float) -> Grasp | None:
    """Palms on opposed sides of a prop that stands turned.

    Args:
        prop: any prop.
        turn: its yaw against the direction from which it is taken, radians.
        height: of the palms above its bottom, metres.

    Returns:
        None where it is too wide, or has no surface or no room for hands at this height.
    """
    vertices, triangles = joined(prop.parts)
    R = about_z(np.array(turn))
    mesh = RayMesh(vertices @ R.T, triangles)
    grip = np.repeat([p.grip for p in prop.parts], [len(p.faces) for p in prop.parts])
    depth = mesh.low[0] + np.array([0.5, 0.35, 0.65, 0.2]) * min(mesh.high[0] - mesh.low[0], 0.7)
    at = np.stack([depth, 0 * depth, 0 * depth + mesh.low[2] + height], axis=1)
    palms = _holdable(opposed(mesh, at, at, grip))
    rows = np.flatnonzero(_have_room(mesh, palms.points, palms.inward)) if len(palms.points) else []
    if not len(rows):
        return None
    return Grasp("lift", palms.points[rows[0]] @ R, palms.inward[rows[0]] @ R)


def _on_bars(rng: np.random.Generator, mesh: RayMesh, plan: Blueprint) -> list[Grasp]:
    out: list[Grasp | None] = []
    for bar in plan.bars:
        length = float(np.linalg.norm(bar.b - bar.a))
        for use in bar.uses:
            for _ in range(max(_TRIES // (2 + len(plan.bars)), 1)):
                one = use == "one_hand" or length < 0.2 or rng.random() < 0.3
                if use == "lift" and one:
                    continue
                out.append(bar_grasps(rng, mesh, bar, one, use))  # pyright: ignore[reportArgumentType]
    return [g for g in out if g is not None and _reachable(g, mesh)]


def _reachable(grasp: Grasp, mesh: RayMesh) -> bool:
    near = grasp.points[:, 0].max() < mesh.low[0] + (0.55 if grasp.kind != "pole" else 0.8)
    return bool(near and np.linalg.norm(np.diff(grasp.points, axis=0)) <= WIDEST_HOLD)


def _on_sides(
    rng: np.random.Generator, mesh: RayMesh, plan: Blueprint, grip: Float[np.ndarray, " faces"]
) -> list[Grasp]:
    palms = _holdable(sides(rng, mesh, grip))
    top = mesh.high[2]
    out: list[Grasp] = []
    for points, inward in zip(palms.points, palms.inward, strict=True):
        z = points[:, 2]
        rim = plan.vessel and z.min() > top - 0.1
        kind: Kind = "rim" if rim else "side"
        if plan.mass < _HEAVIEST_LIFT:
            out.append(Grasp("lift", points, inward, None, kind))
        if z.min() > min(_LOWEST_PUSH, 0.5 * top) and z.max() < 1.3:
            out.append(Grasp("push", points, inward, None, kind))
        if top > 0.5 and z.min() > max(0.55 * top, 0.4):
            out.append(Grasp("tip", points, inward, None, kind))
    out = _draw_grasps(rng, out, {"lift": 6, "push": 2, "tip": 3})
    return out + _low_edges(rng, mesh, plan, grip) + _pinches(mesh, plan, palms_of=out)


def _low_edges(
    rng: np.random.Generator, mesh: RayMesh, plan: Blueprint, grip: Float[np.ndarray, " faces"]
) -> list[Grasp]:
    """Return grasps with the palms turned under the lower side edges."""
    depth = mesh.low[0] + rng.uniform(0.25, 0.6, 6) * min(mesh.high[0] - mesh.low[0], 0.6)
    at = np.stack([depth, 0 * depth, rng.uniform(0.01, 0.05, 6)], axis=1)
    palms = _holdable(opposed(mesh, at, at, grip))
    if plan.mass > _HEAVIEST_LIFT or not len(palms.points):
        return []
    tilt = rng.uniform(0.3, 0.8)
    inward = palms.inward * np.cos(tilt) + _UP * np.sin(tilt)
    inward /= np.linalg.norm(inward, axis=-1, keepdims=True)
    raised = palms.points[..., 2] > 0.04 * np.sin(tilt) + 0.005
    return [
        Grasp("lift", palms.points[k], inward[k], None, "under")
        for k in np.flatnonzero(raised.all(axis=1))[:2]
    ]


def _pinches(mesh: RayMesh, plan: Blueprint, palms_of: list[Grasp]) -> list[Grasp]:
    """Return grasps of a thin prop clamped under the fingers of one hand that hangs beside the body."""
    thin = mesh.high[1] - mesh.low[1] < 0.1
    if not thin or plan.mass > _HEAVIEST_HAND or mesh.high[2] < 0.15:
        return []
    x, z = (mesh.low[0] + mesh.high[0]) / 2, mesh.high[2] - 0.05
    at = np.array([[x, 0.0, z]])
    palms = opposed(mesh, at, at, np.ones(len(mesh.areas)))
    return [
        Grasp("one_hand", p, i, -_UP, "pinch", True)
        for p, i in zip(palms.points, palms.inward, strict=True)
    ]


def _on_near_side(
    rng: np.random.Generator, mesh: RayMesh, plan: Blueprint, grip: Float[np.ndarray, " faces"]
) -> list[Grasp]:
    flat, top, under = faces(rng, mesh, grip), edges(rng, mesh, grip), unders(rng, mesh, grip)
    out = [Grasp("push", p, i, _UP, "face") for p, i in _pairs(flat)]
    out += [
        Grasp("tip", p, i, _UP, "face") for p, i in _pairs(flat) if p[0, 2] > 0.6 * mesh.high[2]
    ]
    out += [
        Grasp("push", p, i, _AHEAD, "edge") for p, i in _pairs(top) if _LOWEST_EDGE < p[0, 2] < 1.2
    ]
    lifts = bool((mesh.high[0] - mesh.low[0]) * plan.mass < _MOST_LEVER)
    for points, inward in _pairs(under):
        if 0.8 < points[0, 2] < 1.3:
            out.append(Grasp("tip", points, inward, _AHEAD, "under"))
            if lifts:
                out.append(Grasp("lift", points, inward, _AHEAD, "under"))
    out += _hooks(rng, overhangs(rng, mesh, grip), lifts=lifts)
    return _draw_grasps(rng, out, {"push": 5, "tip": 3, "lift": 3})


def _hooks(rng: np.random.Generator, found: Palms, *, lifts: bool) -> list[Grasp]:
    """Fingers curled under what overhangs on the near side, hands in line with their forearms."""
    out: list[Grasp] = []
    for points, _ in _pairs(found):
        height = float(points[:, 2].mean())
        inward, fingers = hooked(rng, height)
        fit: dict[Use, bool] = {"push": height > 0.25, "tip": True, "lift": lifts}
        out += [
            Grasp(use, points, np.stack([inward, inward]), fingers, "under")
            for use, good in fit.items()
            if good and height < 1.2
        ]
    return out


def _pairs(palms: Palms) -> list[tuple[Float[np.ndarray, "2 3"], Float[np.ndarray, "2 3"]]]:
    return list(zip(palms.points, palms.inward, strict=True))


def _holdable(palms: Palms) -> Palms:
    """Return the pairs of palms that are neither too far apart nor crossed."""
    left, right = palms.points[:, 0], palms.points[:, 1]
    apart = np.linalg.norm(left - right, axis=1)
    across = left[:, 1] - right[:, 1]
    return palms[np.flatnonzero((apart <= WIDEST_HOLD) & (across >= _NARROWEST_HOLD))]


def _draw_grasps(rng: np.random.Generator, found: list[Grasp], most: dict[Use, int]) -> list[Grasp]:
    """Return a few grasps of each use in random order, twice `most` because some have no room."""
    out: list[Grasp] = []
    for use, count in most.items():
        same = [g for g in found if g.use == use]
        out += [same[k] for k in rng.permutation(len(same))[: 2 * count]]
    return out


def _with_room(mesh: RayMesh, found: list[Grasp]) -> list[Grasp]:
    if not found:
        return []
    points, inward = np.stack([g.points for g in found]), np.stack([g.inward for g in found])
    return [g for g, room in zip(found, _have_room(mesh, points, inward), strict=True) if room]


def _have_room(
    mesh: RayMesh, points: Float[np.ndarray, "n 2 3"], inward: Float[np.ndarray, "n 2 3"]
) -> Bool[np.ndarray, " n"]:
    """Return which pairs of palms (left, right) have room for hands and forearms."""
    out = -inward
    one = np.cross(out, np.where(np.abs(out[..., 2:]) < 0.9, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]))
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    two = np.cross(out, one)
    back = points + out * _HAND_THICKNESS
    towards = _elbows(mesh, points, inward) - back
    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
    middle = points + out * 0.025
    checks = [(points + out * 0.004, out, _HAND_THICKNESS), (back, towards, _FOREARM)]
    checks += [(middle, d, _HAND_REACH) for d in (one, -one, two, -two)]
    origins = np.stack([c[0] for c in checks])
    hits = mesh.cast(
        origins.reshape(-1, 3), np.stack([c[1] for c in checks]).reshape(-1, 3)
    ).distance.reshape(origins.shape[:-1])
    room = np.array([c[2] for c in checks])[:, None, None]
    above_floor = back[..., 2] > 0.0
    return np.all((hits > room).all(axis=0) & above_floor, axis=1)


def _elbows(
    mesh: RayMesh, points: Float[np.ndarray, "n 2 3"], inward: Float[np.ndarray, "n 2 3"]
) -> Float[np.ndarray, "n 2 3"]:
    """Return the elbows of a person at -x: behind and outside the palms, and above low ones."""
    x, y, z = np.moveaxis(points, -1, 0)
    side = np.array([1.0, -1.0])
    rise = ((1.0 - z) * 0.35).clip(-0.2, 0.3)
    # Palms that carry from below have their forearms below the edge.
    rise = np.where(inward[..., 2] > 0.7, np.minimum(rise, -0.06), rise)
    behind = np.minimum(mesh.low[0], x - 0.1) - _ELBOW_BEHIND
    return np.stack([behind, y * 1.1 + side * 0.1, z + rise], axis=-1)
