"""best_views: which picture each triangle of a scan's mesh is painted from."""

from collections.abc import Sequence

import igl
import numpy as np
import trimesh
from jaxtyping import Bool, Float64, Int64

from ingest.scan.dense.picture import SmallPictures
from omomo_core.geometry.transforms import inverse

NONE = -1
"""Of a triangle that no picture shows well."""
_SLANT = 0.2
"""Cosine between a triangle's normal and the way to the camera, at least."""
_OFF = 2e-3
"""Metres before the surface where sight begins."""
_CALM = 1.15
"""A neighbour's picture is taken where it is nearly as good: fewer seams."""
_ROUNDS = 3

Masks = Sequence[np.ndarray | None]


def best_views(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    pictures: SmallPictures,
    masks: Masks,
) -> Int64[np.ndarray, " faces"]:
    """The view that shows each triangle largest with nothing before it; `NONE` where none does.

    Args:
        vertices, faces: world, metres; wound to look outwards.
        pictures: of the views.
        masks: silhouettes of the same views; a triangle beside them is not painted from there.
    """
    normals = np.asarray(igl.per_face_normals(vertices, faces, np.zeros(3)), np.float64)
    middles = vertices[faces].mean(axis=1)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    size = np.stack(
        [_size(middles, normals, mesh, pictures, k, mask) for k, mask in enumerate(masks)], axis=1
    )
    best = np.where(size.max(axis=1) > 0, size.argmax(axis=1), NONE).astype(np.int64)
    return _calmed(best, size, np.asarray(mesh.face_adjacency, np.int64))


def _size(
    middles: Float64[np.ndarray, "faces 3"],
    normals: Float64[np.ndarray, "faces 3"],
    mesh: trimesh.Trimesh,
    pictures: SmallPictures,
    index: int,
    mask: np.ndarray | None,
) -> Float64[np.ndarray, " faces"]:
    """How large a view shows each triangle, by its area; 0 where it is hidden or slanted."""
    T = pictures.views[index].T_world_camera
    way = T[:3, 3] - middles
    far = np.linalg.norm(way, axis=1)
    cosine = np.einsum("ij,ij->i", normals, way) / far
    u, v, z = pictures.matrix(index) @ (inverse(T)[:3] @ np.c_[middles, np.ones(len(middles))].T)
    width, height = pictures.size(index)
    ahead = np.maximum(z, 1e-6)
    column, row = np.rint(u / ahead).astype(int), np.rint(v / ahead).astype(int)
    shown = (z > 0) & (cosine > _SLANT) & (column > 1) & (row > 1)
    shown &= (column < width - 2) & (row < height - 2)
    if mask is not None:
        rows, columns = mask.shape
        at = (
            (row * rows // height).clip(0, rows - 1),
            (column * columns // width).clip(0, columns - 1),
        )
        shown &= mask[at] > 0
    shown[shown] = ~_hidden(mesh, middles[shown] + _OFF * normals[shown], way[shown])
    return np.where(shown, cosine / far**2, 0.0)


def _hidden(
    mesh: trimesh.Trimesh, start: Float64[np.ndarray, "n 3"], way: Float64[np.ndarray, "n 3"]
) -> Bool[np.ndarray, " n"]:
    if not len(start):
        return np.zeros(0, np.bool_)
    return np.asarray(mesh.ray.intersects_any(start, way), np.bool_)


def _calmed(
    best: Int64[np.ndarray, " faces"],
    size: Float64[np.ndarray, "faces views"],
    beside: Int64[np.ndarray, "pairs 2"],
) -> Int64[np.ndarray, " faces"]:
    """The views with those of neighbours in their place where most neighbours agree on them."""
    ways = np.concatenate([beside, beside[:, ::-1]])
    number = np.arange(len(best))
    for _ in range(_ROUNDS):
        votes = np.zeros(size.shape, np.int8)
        theirs = best[ways[:, 1]]
        known = theirs >= 0
        np.add.at(votes, (ways[known, 0], theirs[known]), 1)
        wanted = votes.argmax(axis=1)
        enough = votes[number, wanted] >= 2
        mine = size[number, best.clip(0)]
        good = _CALM * size[number, wanted] >= mine
        best = np.where((best >= 0) & enough & good & (size[number, wanted] > 0), wanted, best)
    return best
