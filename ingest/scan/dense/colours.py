"""coloured: what colour the views show at each place of a surface."""

import cv2
import igl
import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt8
from scipy.spatial import KDTree

from ingest.scan.dense.depth_map import DepthMap, DepthMaps
from ingest.scan.dense.picture import SmallPictures, at_pixels, matrix_for, projected

_CLOSE, _CLOSE_SHARE = 0.01, 0.01
"""Metres, and parts of the depth, that a place may lie beside what a view sees there."""
_FRONTAL = 4
"""Power of the cosine to the normal: who looks straight at a place knows its colour best."""
_PLAIN = 160


def coloured(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    pictures: SmallPictures,
    depths: DepthMaps,
) -> UInt8[np.ndarray, "verts 3"]:
    """Mean colour that the views show of each vertex; of the nearest that is shown for the others.

    Args:
        vertices, faces: world, metres; faces are wound to look outwards.
        pictures: of the views.
        depths: of the views, 0 where unknown; of any size.
    """
    normals = np.asarray(igl.per_vertex_normals(vertices, faces), np.float64)
    total = np.zeros((len(vertices), 3), np.float32)
    weights = np.zeros(len(vertices), np.float32)
    for index, depth in enumerate(depths):
        weight = _sight(vertices, normals, pictures, index, depth)
        shown = _sampled(vertices, pictures, index)
        total += weight[:, None] * shown
        weights += weight
    known = weights > 0
    if not known.any():
        return np.full((len(vertices), 3), _PLAIN, np.uint8)
    colours = total / np.maximum(weights, 1e-9)[:, None]
    if not known.all():
        colours[~known] = colours[known][KDTree(vertices[known]).query(vertices[~known])[1]]
    return np.rint(colours).clip(0, 255).astype(np.uint8)


def _sight(
    vertices: Float64[np.ndarray, "verts 3"],
    normals: Float64[np.ndarray, "verts 3"],
    pictures: SmallPictures,
    index: int,
    depth: DepthMap,
) -> Float32[np.ndarray, " verts"]:
    """How well a view sees each vertex; 0 for what is hidden."""
    view = pictures.views[index]
    u, v, z = projected(vertices, view.T_world_camera, matrix_for(view, depth.shape[::-1]))
    shown = at_pixels(depth, u, v, cv2.INTER_NEAREST)
    close = (shown > 0) & (np.abs(shown - z) < _CLOSE + _CLOSE_SHARE * z)
    to_eye = view.T_world_camera[:3, 3] - vertices
    cosine = np.einsum("ij,ij->i", normals, to_eye) / np.linalg.norm(to_eye, axis=1)
    return (close * np.nan_to_num(cosine).clip(0, 1) ** _FRONTAL).astype(np.float32)


def _sampled(
    vertices: Float64[np.ndarray, "verts 3"], pictures: SmallPictures, index: int
) -> Float32[np.ndarray, "verts 3"]:
    """The picture's colour at each vertex, whether it is hidden or not."""
    T = pictures.views[index].T_world_camera
    u, v, _ = projected(vertices, T, pictures.matrix(index))
    return at_pixels(pictures.picture(index).colours, u, v, cv2.INTER_LINEAR).astype(np.float32)
