"""A clean solid as a phone scan shows it: uneven, noisy, with holes, crumbs and no underside."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from omomo_core.learning.synthesis.shapes import SolidPart, joined

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
