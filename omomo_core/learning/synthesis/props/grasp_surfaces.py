"""Places for palms found by rays: opposed surfaces, bars and poles."""

from dataclasses import dataclass

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Bool, Float, Int

from omomo_core.learning.synthesis.props.prop import Grasp, GripBar, Use


@dataclass(frozen=True)
class Hits:
    """What each ray met first."""

    distance: Float[np.ndarray, " rays"]
    """Metres; inf where it met nothing."""
    points: Float[np.ndarray, "rays 3"]
    normals: Float[np.ndarray, "rays 3"]
    """Outward, unit; zero where it met nothing."""
    faces: Int[np.ndarray, " rays"]
    """-1 where it met nothing."""


class RayMesh:
    """A triangle mesh that can be asked what a ray meets first."""

    def __init__(
        self, vertices: Float[np.ndarray, "verts 3"], faces: Int[np.ndarray, "faces 3"]
    ) -> None:
        self.low, self.high = vertices.min(axis=0), vertices.max(axis=0)
        self.triangles = vertices[faces]
        cross = np.cross(
            self.triangles[:, 1] - self.triangles[:, 0], self.triangles[:, 2] - self.triangles[:, 0]
        )
        doubled = np.linalg.norm(cross, axis=1)
        self.areas = doubled / 2
        self.normals = cross / np.maximum(doubled, 1e-12)[:, None]
        self._scene = EmbreeScene()
        TriangleMesh(self._scene, self.triangles.astype(np.float32))

    def cast(
        self, origins: Float[np.ndarray, "rays 3"], directions: Float[np.ndarray, "rays 3"]
    ) -> Hits:
        """The first surface along each ray of unit direction."""
        found = self._scene.run(
            np.ascontiguousarray(origins, dtype=np.float32),
            np.ascontiguousarray(directions, dtype=np.float32),
            query="INTERSECT",
            output=True,
        )
        face = found["primID"].astype(np.int64)
        met = face >= 0
        distance = np.where(met, found["tfar"].astype(float), np.inf)
        points = origins + np.where(met, distance, 0.0)[:, None] * directions
        return Hits(distance, points, self.normals[face] * met[:, None], face)


_UP = np.array([0.0, 0, 1])
_AHEAD = np.array([1.0, 0, 0])
_LEFT = np.array([0.0, 1, 0])
_REACH = 0.4
"""How far behind its near side a thing is held, metres."""
_SAMPLES = 160


@dataclass(frozen=True)
class Palms:
    """Candidate pairs, index 0 left."""

    points: Float[np.ndarray, "n 2 3"]
    inward: Float[np.ndarray, "n 2 3"]

    def __getitem__(self, rows: np.ndarray) -> "Palms":
        return Palms(self.points[rows], self.inward[rows])


def sides(rng: np.random.Generator, mesh: RayMesh, grip: Float[np.ndarray, " faces"]) -> Palms:
    """Palms on the left and on the right, at the same place or at different heights and depths."""
    facing = np.abs(mesh.normals[:, 1]) > 0.7
    at = _samples(rng, mesh, grip * facing, _SAMPLES)
    at = at[at[:, 0] < mesh.low[0] + _REACH]
    other = at[rng.permutation(len(at))]
    near = np.linalg.norm(at[:, [0, 2]] - other[:, [0, 2]], axis=1) < 0.45
    other = np.where((near & (rng.random(len(at)) < 0.3))[:, None], other, at)
    return opposed(mesh, at, other, grip)


def opposed(
    mesh: RayMesh,
    left: Float[np.ndarray, "n 3"],
    right: Float[np.ndarray, "n 3"],
    grip: Float[np.ndarray, " faces"],
) -> Palms:
    """The outermost surface on both sides at given depths and heights.

    Args:
        mesh: the thing.
        left: points whose y does not matter, for the left palm.
        right: the same for the right palm.
        grip: how readily each face is held.
    """
    if not len(left):
        return Palms(np.zeros((0, 2, 3)), np.zeros((0, 2, 3)))
    side = np.array([1.0, -1.0])[:, None] * _LEFT
    origins = np.stack([left, right], axis=1)
    origins[..., 1] = [mesh.high[1] + 0.1, mesh.low[1] - 0.1]
    n = len(left)
    hits = mesh.cast(origins.reshape(-1, 3), np.tile(-side, (n, 1, 1)).reshape(-1, 3))
    normals = hits.normals.reshape(n, 2, 3)
    held = (hits.faces >= 0) & (grip[hits.faces] > 0.3)
    good = held.reshape(n, 2) & ((normals * side).sum(-1) > 0.8)
    rows = np.flatnonzero(good.all(axis=1))
    return Palms(hits.points.reshape(n, 2, 3)[rows], -normals[rows])


def faces(rng: np.random.Generator, mesh: RayMesh, grip: Float[np.ndarray, " faces"]) -> Palms:
    """Palms flat on what faces the person, side by side, leaning into it with the heels of the hands."""
    # Of low things the upper half.
    low, high = min(0.5 * mesh.high[2], 0.6), min(mesh.high[2], 0.6)
    z = np.concatenate(
        [rng.uniform(0.75, 1.3, 16), rng.uniform(0.5, 0.8, 8), rng.uniform(low, high, 8)]
    )
    points, normals, rows = _seen(mesh, grip, _spread(rng, mesh, len(z)), z)
    flat = rows & (normals[..., 0] < -0.9).all(axis=1) & (np.ptp(points[..., 0], axis=1) < 0.02)
    flat &= points[..., 0].max(axis=1) < mesh.low[0] + 0.15
    tilt = rng.uniform(0.4, 0.75, len(points))
    inward = np.cos(tilt)[:, None] * _AHEAD - np.sin(tilt)[:, None] * _UP
    return Palms(points, np.repeat(inward[:, None], 2, axis=1))[np.flatnonzero(flat)]


def edges(rng: np.random.Generator, mesh: RayMesh, grip: Float[np.ndarray, " faces"]) -> Palms:
    """Palms down on a top surface, or leaning on its near edge."""
    tops = grip * (mesh.normals[:, 2] > 0.95)
    levels = _samples(rng, mesh, tops, 20)[:, 2]
    spread = _spread(rng, mesh, len(levels))
    edge, _, rows = _seen(mesh, grip, spread, levels - 0.006)
    inside = rng.uniform(0.01, 0.08, len(levels))
    above = edge + (inside[:, None] * _AHEAD + 0.07 * _UP)[:, None]
    hits = mesh.cast(above.reshape(-1, 3), np.tile(-_UP, (2 * len(above), 1)))
    points, normals = hits.points.reshape(-1, 2, 3), hits.normals.reshape(-1, 2, 3)
    rows &= (normals[..., 2] > 0.9).all(axis=1)
    rows &= (np.abs(points[..., 2] - levels[:, None]) < 0.004).all(axis=1)
    rows &= np.ptp(edge[..., 0], axis=1) < 0.03
    # At the very edge the heel of the hand pushes it; farther in the hands lie flat.
    tilt = np.where(inside < 0.03, rng.uniform(0.5, 1.1, len(levels)), np.pi / 2)
    inward = np.cos(tilt)[:, None] * _AHEAD - np.sin(tilt)[:, None] * _UP
    return Palms(points, np.repeat(inward[:, None], 2, axis=1))[np.flatnonzero(rows)]


def unders(rng: np.random.Generator, mesh: RayMesh, grip: Float[np.ndarray, " faces"]) -> Palms:
    """Palms up under something that overhangs, near the person."""
    below = grip * (mesh.normals[:, 2] < -0.95)
    at = _samples(rng, mesh, below, 40)
    at = at[(at[:, 2] > 0.1) & (at[:, 0] < mesh.low[0] + 0.12)]
    if not len(at):
        return Palms(np.zeros((0, 2, 3)), np.zeros((0, 2, 3)))
    y = _spread(rng, mesh, len(at))
    origins = np.stack(
        [np.repeat(at[:, :1], 2, axis=1), y, np.repeat(at[:, 2:] - 0.08, 2, axis=1)], -1
    )
    hits = mesh.cast(origins.reshape(-1, 3), np.tile(_UP, (2 * len(at), 1)))
    points, normals = hits.points.reshape(-1, 2, 3), hits.normals.reshape(-1, 2, 3)
    rows = (normals[..., 2] < -0.9).all(axis=1) & (np.ptp(points[..., 2], axis=1) < 0.02)
    return Palms(points, np.broadcast_to(_UP, points.shape).copy())[np.flatnonzero(rows)]


def overhangs(rng: np.random.Generator, mesh: RayMesh, grip: Float[np.ndarray, " faces"]) -> Palms:
    """Places on the near side, right above where fingers can curl under it; inward is ahead."""
    at = _samples(rng, mesh, grip * (mesh.normals[:, 2] < -0.95), 40)
    at = at[(at[:, 2] > 0.1) & (at[:, 0] < mesh.low[0] + 0.12)]
    if not len(at):
        return Palms(np.zeros((0, 2, 3)), np.zeros((0, 2, 3)))
    y, z = _spread(rng, mesh, len(at)), at[:, 2]
    points, normals, rows = _seen(mesh, grip, y, z + 0.008)
    # Under it there is nothing for the length of the fingers.
    below = points + np.array([-0.05, 0.0, -0.03])
    room = mesh.cast(below.reshape(-1, 3), np.tile(_AHEAD, (below.size // 3, 1))).distance
    rows &= (room.reshape(-1, 2) > 0.11).all(axis=1)
    rows &= (normals[..., 0] < -0.7).all(axis=1) & (np.ptp(points[..., 0], axis=1) < 0.03)
    rows &= (points[..., 0] < mesh.low[0] + 0.1).all(axis=1)
    return Palms(points, np.broadcast_to(_AHEAD, points.shape).copy())[np.flatnonzero(rows)]


def _samples(
    rng: np.random.Generator, mesh: RayMesh, weight: Float[np.ndarray, " faces"], count: int
) -> Float[np.ndarray, "n 3"]:
    """Random points on faces; large ones are chosen more often, though less than their size."""
    chance = weight * np.sqrt(mesh.areas)
    if chance.sum() <= 0.0:
        return np.zeros((0, 3))
    rows = rng.choice(len(chance), count, p=chance / chance.sum())
    return np.einsum("nk,nkd->nd", rng.dirichlet(np.ones(3), count), mesh.triangles[rows])


def _spread(rng: np.random.Generator, mesh: RayMesh, count: int) -> Float[np.ndarray, "n 2"]:
    """y of hands side by side, from close together to somewhat wider than the shoulders, anywhere."""
    half = (mesh.high[1] - mesh.low[1]) / 2
    apart = np.minimum(rng.uniform(0.05, 0.28, count), half - 0.03).clip(0.04)
    aside = rng.normal(0.0, 0.3, count).clip(-1.0, 1.0)
    middle = (mesh.high[1] + mesh.low[1]) / 2 + aside * (half - apart)
    return np.stack([middle + apart, middle - apart], axis=1)


def _seen(
    mesh: RayMesh,
    grip: Float[np.ndarray, " faces"],
    y: Float[np.ndarray, "n 2"],
    z: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, "n 2 3"], Float[np.ndarray, "n 2 3"], Bool[np.ndarray, " n"]]:
    """What the person sees there: points, normals, and whether both palms could lie on it."""
    x = np.full_like(y, mesh.low[0] - 0.3)
    origins = np.stack([x, y, np.repeat(z[:, None], 2, axis=1)], axis=-1)
    hits = mesh.cast(origins.reshape(-1, 3), np.tile(_AHEAD, (2 * len(y), 1)))
    points, normals = hits.points.reshape(-1, 2, 3), hits.normals.reshape(-1, 2, 3)
    held = (hits.faces >= 0) & (grip[hits.faces] > 0.3)
    return points, normals, np.all(held.reshape(-1, 2), axis=1)


_THICKEST = 0.06
"""From the axis of a bar to its surface, metres."""
_HIGHEST, _LOWEST = 1.5, 0.3
"""Heights between which poles are taken, metres."""
_HOOKED = ([0.6, 1.1], [0.8, 0.25])
"""How often bars at a height are hooked from below, metres."""
_HANGS = ([0.1, 0.7, 1.05, 1.3, 1.7], [1.35, 0.95, 0.4, -0.15, -1.2])
"""How far forearms slope down to hands at a height: metres, radians."""


def slope(height: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """How far a forearm slopes down to a hand at a height, metres and radians."""
    return np.interp(height, *_HANGS)


def hooked(
    rng: np.random.Generator, height: float
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Palm and fingers of hands that hang in line with their forearms, fingers curled under a thing."""
    drop = float(slope(np.array([height]))[0]) + rng.normal(0.0, 0.2)
    ahead, down = np.cos(drop), np.sin(drop)
    return down * _AHEAD + ahead * _UP, ahead * _AHEAD - down * _UP


def bar_grasps(
    rng: np.random.Generator, mesh: RayMesh, bar: GripBar, one_handed: bool, use: Use
) -> Grasp | None:
    """One way to take a bar, or None where its surface is not found (something covers it)."""
    along = (bar.b - bar.a) / np.linalg.norm(bar.b - bar.a)
    if abs(along[2]) > 0.35 or (bar.kind == "pole" and abs(along[1]) < 0.7):
        where, inward, fingers = _pole(rng, bar, along, one_handed)
    elif abs(along[1]) > 0.7:
        where, inward, fingers = _across(rng, bar, one_handed)
    elif one_handed:
        where, inward, fingers = _lengthwise(rng, bar, along)
    else:
        return None
    palms = _snapped(mesh, where, inward)
    return None if palms is None else Grasp(use, palms, inward, fingers, bar.kind, one_handed)


_Wish = tuple[Float[np.ndarray, "2 3"], Float[np.ndarray, "2 3"], Float[np.ndarray, " 3"]]


def _pole(
    rng: np.random.Generator, bar: GripBar, along: Float[np.ndarray, " 3"], one: bool
) -> _Wish:
    """A pole between the hands, one above the other; or in one fist."""
    low, high = sorted((float(bar.a[2]), float(bar.b[2])))
    low, high = max(low, min(_LOWEST, high)), max(min(high, _HIGHEST), low)
    middle = (
        np.clip(rng.normal(0.55, 0.2), 0.05, 0.95) if high - low > 0.5 else rng.uniform(0.2, 0.8)
    )
    z = np.repeat(low + (high - low) * middle, 2)
    if not one:
        gap = min(rng.uniform(0.14, 0.45), high - low)
        z = np.clip(z, low + gap / 2, high - gap / 2) + np.array([0.5, -0.5]) * gap
        z = z if rng.random() < 0.5 else z[::-1]
    where = bar.a + ((z - bar.a[2]) / (bar.b[2] - bar.a[2]))[:, None] * (bar.b - bar.a)
    roll = rng.uniform(-0.3, 0.6)
    inward = np.stack([-_LEFT, _LEFT]) * np.cos(roll) + _AHEAD * np.sin(roll)
    fingers = _flat(_AHEAD, along)
    return where, np.stack([_flat(i, along) for i in inward]), fingers


def _across(rng: np.random.Generator, bar: GripBar, one: bool) -> _Wish:
    """A bar from left to right: from above, from behind, or from below."""
    middle, half = (bar.a + bar.b) / 2, abs(float(bar.b[1] - bar.a[1])) / 2
    apart = min(max(half - 0.04, 0.0), rng.uniform(0.05, 0.28)) if not one else 0.0
    along = (bar.b - bar.a) / (bar.b - bar.a)[1]
    shift = 0.0 if not one else rng.uniform(-0.6, 0.6) * max(half - 0.05, 0.0)
    where = middle + np.array([shift + apart, shift - apart])[:, None] * along
    if bar.kind == "handle":
        # The hand hangs behind its knuckles, palm to the back: as one carries things in front.
        return where, np.stack([-_AHEAD, -_AHEAD]), -_UP
    if rng.random() < np.interp(middle[2], *_HOOKED):
        inward, fingers = hooked(rng, float(middle[2]))
        return where, np.stack([inward, inward]), fingers
    tilt = rng.uniform(0.3, 1.4)
    inward = np.cos(tilt) * _AHEAD - np.sin(tilt) * _UP
    return where, np.stack([inward, inward]), np.sin(tilt) * _AHEAD + np.cos(tilt) * _UP


def _lengthwise(rng: np.random.Generator, bar: GripBar, along: Float[np.ndarray, " 3"]) -> _Wish:
    """A bar that points away, in a hand that hangs beside the body."""
    reach = np.clip(rng.normal(0.5, 0.12), 0.2, 0.8)
    where = bar.a + reach * (bar.b - bar.a)
    inward = np.stack([_flat(-_LEFT, along), _flat(_LEFT, along)])
    return np.stack([where, where]), inward, -_UP


def _flat(v: Float[np.ndarray, " 3"], normal: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 3"]:
    """The part of a vector across a direction, unit length."""
    across = v - normal * (v @ normal)
    return across / np.linalg.norm(across)


def _snapped(
    mesh: RayMesh, where: Float[np.ndarray, "2 3"], inward: Float[np.ndarray, "2 3"]
) -> Float[np.ndarray, "2 3"] | None:
    """From points on the axis out to the surface."""
    hits = mesh.cast(where - _THICKEST * inward, inward)
    found = (hits.distance < _THICKEST + 0.002) & ((hits.normals * inward).sum(-1) < -0.4)
    return hits.points if found.all() else None
