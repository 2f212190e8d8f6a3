"""main_piece: the object's faces, without crumbs and cavities."""

import igl
import numpy as np
from jaxtyping import Bool, Float64, Int64
from scipy.spatial import KDTree

_SHARE = 0.01
"""Of the area of the largest piece: smaller ones are crumbs."""
_GAP = 0.03
"""Metres: a thin part may be broken that far from the rest."""


def main_piece(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"]
) -> Bool[np.ndarray, " faces"]:
    """Which faces are the object's: the largest piece, and large ones that nearly touch it.

    A closed piece that is wound inwards is a cavity that nobody sees; it is left out.
    """
    number = np.asarray(igl.facet_components(faces)[1], np.int64)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.bincount(number, np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)
    # Six times the volume; of an open piece it says little, but is seldom below zero.
    content = np.bincount(number, np.einsum("ij,ij->i", a - a.mean(axis=0), np.cross(b, c)))
    kept = [int(area.argmax())]
    for piece in np.argsort(-area)[1:]:
        if area[piece] < _SHARE * area[kept[0]]:
            break
        if content[piece] > 0 and _near(vertices, faces, number, int(piece), kept):
            kept.append(int(piece))
    return np.isin(number, kept)


def _near(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    number: Int64[np.ndarray, " faces"],
    piece: int,
    kept: list[int],
) -> bool:
    mine = vertices[np.unique(faces[number == piece])]
    theirs = vertices[np.unique(faces[np.isin(number, kept)])]
    return bool(KDTree(theirs).query(mine, distance_upper_bound=_GAP)[0].min() < _GAP)
