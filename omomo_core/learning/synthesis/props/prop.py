"""What a prop is: its blueprint, ways to hold it, and how a phone scan shows it.

A prop stands on z = 0 at the origin of its own frame; a person who handles it stands at -x and looks
along +x, with +y to the left. Metres.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from omomo_core.learning.synthesis.shapes import Point, SolidPart, joined
from omomo_core.motion import ObjectMesh

MOST_VERTICES = 1500
_FINEST = 0.025
_KEPT = 0.03
"""No hole comes closer to a palm, metres."""

_Mesh = tuple[Float[np.ndarray, "verts 3"], Int[np.ndarray, "faces 3"]]


def scanned(
    rng: np.random.Generator, parts: Sequence[SolidPart], palms: Float[np.ndarray, "palms 3"]
) -> _Mesh:
    """Vertices and faces of an imperfect scan of these parts.

    Args:
        rng: source of all randomness.
        parts: the clean solid.
        palms: places around which the surface stays whole.
    """
    vertices, faces = _tessellated(rng, *joined(parts))
    faces = faces[_seen(rng, vertices, faces, palms)]
    vertices = vertices + _noise(rng, vertices)
    return _compact(*_with_crumbs(rng, vertices, faces))


def _tessellated(
    rng: np.random.Generator, vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]
) -> _Mesh:
    """Edges split until they are as short as the budget of vertices allows, here more, there less."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    budget = rng.uniform(0.35, 0.95) * MOST_VERTICES
    edge = 3.0 * np.sqrt(area / (0.6 * budget))
    wave, phase = rng.normal(0.0, 6.0, 3), rng.uniform(0.0, 6.3)
    while edge > _FINEST:
        longest = edge * (1.1 + 0.5 * np.sin(vertices @ wave + phase))
        split = _split_long(vertices, faces, longest)
        if split is None:
            edge *= 0.65
        elif len(split[0]) > budget:
            break
        else:
            vertices, faces = split
    return vertices, faces


def _split_long(
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    longest: Float[np.ndarray, " v"],
) -> _Mesh | None:
    """Every edge that is too long cut in the middle; None when there is none."""
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    keys, index = np.unique(ends[:, 0] * len(vertices) + ends[:, 1], return_inverse=True)
    a, b = keys // len(vertices), keys % len(vertices)
    length = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    long = length > (longest[a] + longest[b]) / 2
    if not long.any():
        return None
    middle = np.where(long, len(vertices) + np.cumsum(long) - 1, -1)[index].reshape(-1, 3)
    added = (vertices[a[long]] + vertices[b[long]]) / 2
    return np.concatenate([vertices, added]), _templates(faces, middle)


def _templates(
    faces: Int[np.ndarray, "f 3"], middle: Int[np.ndarray, "f 3"]
) -> Int[np.ndarray, "g 3"]:
    """Faces cut at the middles of their edges (-1: edge left whole)."""
    count = (middle >= 0).sum(axis=1)
    out = [faces[count == 0]]
    for number in (1, 2, 3):
        rows = np.flatnonzero(count == number)
        # Turned such that the first edge is cut, and with two cuts the first and the second.
        cut = middle[rows] >= 0
        first = np.argmax(cut & (np.roll(cut, 1, axis=1) == 0), axis=1) if number < 3 else 0 * rows
        order = (first[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(faces[rows], order, axis=1).T
        ab, bc, ca = np.take_along_axis(middle[rows], order, axis=1).T
        triangles = {
            1: [(a, ab, c), (ab, b, c)],
            2: [(ab, b, bc), (a, ab, bc), (a, bc, c)],
            3: [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
        }[number]
        out += [np.stack(t, axis=1) for t in triangles]
    return np.concatenate(out)


def _seen(
    rng: np.random.Generator,
    vertices: Float[np.ndarray, "v 3"],
    faces: Int[np.ndarray, "f 3"],
    palms: Float[np.ndarray, "palms 3"],
) -> Bool[np.ndarray, " f"]:
    """Faces that the phone saw: not the underside, and not some random spots."""
    corners = vertices[faces]
    centres = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    height = np.ptp(vertices[:, 2])
    low = centres[:, 2] < vertices[:, 2].min() + rng.uniform(0.02, 0.3) * height
    lost = low & (normals[:, 2] < -0.7)
    if rng.random() < 0.3:
        lost |= normals[:, 2] < -0.85
    spots = centres[rng.integers(len(centres), size=rng.integers(2, 7))]
    radii = rng.uniform(0.015, 0.07, len(spots)) * min(1.0, 2 * height)
    lost |= (np.linalg.norm(centres[:, None] - spots, axis=-1) < radii).any(axis=1)
    if len(palms):
        size = np.linalg.norm(corners - centres[:, None], axis=-1).max(axis=1)
        lost &= KDTree(palms).query(centres)[0] > size + _KEPT
    lost[rng.integers(len(lost))] |= not lost.any()
    return ~lost


def _noise(
    rng: np.random.Generator, vertices: Float[np.ndarray, "v 3"]
) -> Float[np.ndarray, "v 3"]:
    """A slow warp and a rough grain, 1-4 mm together."""
    size = rng.uniform(0.0008, 0.0022)
    waves = vertices @ rng.normal(0.0, 8.0, (3, 3)) + rng.uniform(0.0, 6.3, 3)
    grain = rng.normal(size=vertices.shape).clip(-1.8, 1.8)
    return size * (0.5 * np.sin(waves) + 0.6 * grain)


def _with_crumbs(
    rng: np.random.Generator, vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]
) -> _Mesh:
    """Small loose triangles floating beside the surface."""
    count = int(rng.integers(0, 9))
    at = vertices[rng.integers(len(vertices), size=count)] + rng.normal(0.0, 0.012, (count, 3))
    crumbs = at[:, None] + rng.normal(0.0, 0.008, (count, 3, 3))
    crumbs[..., 2] = np.maximum(crumbs[..., 2], vertices[:, 2].min())
    loose = len(vertices) + np.arange(3 * count).reshape(-1, 3)
    return np.concatenate([vertices, crumbs.reshape(-1, 3)]), np.concatenate([faces, loose])


def _compact(vertices: Float[np.ndarray, "v 3"], faces: Int[np.ndarray, "f 3"]) -> _Mesh:
    """Only the vertices that faces use."""
    used, index = np.unique(faces, return_inverse=True)
    return vertices[used], index.reshape(-1, 3)


Use = Literal["lift", "push", "one_hand", "tool", "tip"]
"""Lifted with both hands; slid over the floor (pushed, pulled, dragged, turned); carried in one hand;
a pole whose end is swept over the floor; tilted on an edge or on some of its legs."""
Kind = Literal["side", "edge", "under", "rim", "face", "rail", "pole", "handle", "pinch"]
"""Opposed sides; palms on top near the near edge; under something; opposed sides at the rim of a
vessel; palms flat on the near face; a bar across; a bar to close the hands around; a carrying handle;
something thin between thumb and fingers."""


@dataclass(frozen=True)
class Grasp:
    """The places of the palms on a prop; index 0 is left, 1 right."""

    use: Use
    points: Float[np.ndarray, "2 3"]
    """On the surface, prop frame."""
    inward: Float[np.ndarray, "2 3"]
    """From the palm into the surface, unit length."""
    fingers: Float[np.ndarray, " 3"] | None = None
    """Direction of the fingers; None lets them follow the forearm."""
    kind: Kind = "side"
    one_handed: bool = False
    """Either hand alone: index 0 is how the left would do it, index 1 how the right would."""


@dataclass(frozen=True)
class Prop:
    """A thing with its possible grasps."""

    name: str
    parts: list[SolidPart]
    grasps: list[Grasp]
    mass: float = 5.0
    """Estimate, kilograms."""
    wheels: bool = False
    stands: bool = True
    """False for what falls over when it is let go."""

    @property
    def low(self) -> Float[np.ndarray, " 3"]:
        """Lower corner of the bounding box."""
        return np.min([p.low for p in self.parts], axis=0)

    @property
    def high(self) -> Float[np.ndarray, " 3"]:
        """Upper corner of the bounding box."""
        return np.max([p.high for p in self.parts], axis=0)

    def mesh(self, rng: np.random.Generator) -> ObjectMesh:
        """Its surface as a phone would scan it, whole within 1 cm around every palm; prop frame."""
        palms = np.concatenate([g.points for g in self.grasps] or [np.zeros((0, 3))])
        return ObjectMesh(*scanned(rng, self.parts, palms), self.name)


def scaled(prop: Prop, scale: float) -> Prop:
    """The prop in the world of somebody who is `scale` times as large; its weight stays."""
    parts = [
        replace(p, vertices=p.vertices * scale, low=p.low * scale, high=p.high * scale)
        for p in prop.parts
    ]
    grasps = [replace(g, points=g.points * scale) for g in prop.grasps]
    return replace(prop, parts=parts, grasps=grasps)


BarKind = Literal["pole", "rail", "handle"]


@dataclass(frozen=True)
class GripBar:
    """Something long that a hand closes around."""

    kind: BarKind
    a: Float[np.ndarray, " 3"]
    b: Float[np.ndarray, " 3"]
    """Ends of the stretch of the axis that hands may take."""
    uses: tuple[str, ...]


@dataclass(frozen=True)
class Blueprint:
    """A thing with its front at +x, standing on z = 0."""

    name: str
    parts: list[SolidPart]
    mass: float
    bars: list[GripBar] = field(default_factory=list)
    sides: tuple[float, float, float, float] = (0.25, 0.25, 0.25, 0.25)
    """How often people stand behind it (-x), at its right (-y), before it (+x), at its left (+y)."""
    wheels: bool = False
    stands: bool = True
    vessel: bool = False
    """Open at the top: its sides have a rim."""
    whole: bool = True
    """False when only its bars are held."""


def bar(kind: BarKind, a: Point, b: Point, *uses: str) -> GripBar:
    """A bar between two points."""
    return GripBar(kind, np.array(a, float), np.array(b, float), uses)


_QUARTERS = [
    np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]], float)
    for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))
]


def turned(plan: Blueprint, side: int) -> Blueprint:
    """The thing as seen by a person at one of its sides (see `Blueprint.sides`)."""
    matrix = _QUARTERS[side]
    return replace(
        plan,
        parts=[p.moved(matrix) for p in plan.parts],
        bars=[replace(b, a=matrix @ b.a, b=matrix @ b.b) for b in plan.bars],
    )
