"""The picture on a scan's mesh: unwrapped, painted from the best pictures, seams levelled.

The surface is unwrapped by xatlas. Each triangle is painted from the picture that shows it best; what
that differs at its corners from the mean colour of all pictures is taken away, spread over the triangle,
so that seams between pictures do not show (as the local adjustment of Waechter et al. 2014).
"""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import igl
import numpy as np
import trimesh
import xatlas
from jaxtyping import Bool, Float32, Float64, Int32, Int64, UInt8

from ingest.scan.clean_mesh import CleanMesh
from ingest.scan.dense.stereo import SmallPictures, at_pixels, projected
from ingest.scan.scan_types import View
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import Texture

NONE = -1
"""Number for a triangle that no picture shows well."""
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


SIDE = 2048
"""Pixels along each side of the atlas."""
WIDTH = 1600
"""Pixels of the pictures that paint it."""
_PADDING = 3
"""Pixels between parts of the atlas."""
_LEVEL = 4.0
"""Pixels of the blur under which pictures are compared with the mean colour."""
_GROWN = 4
"""Pixels by which parts are painted beyond their rim."""

Uv = Float64[np.ndarray, "faces 3 2"]


def add_texture(cleaned: CleanMesh, views: Sequence[View], masks: Masks) -> CleanMesh:
    """The mesh with a texture; as it is where its vertices have no colours."""
    mesh, T = cleaned.mesh, cleaned.T_world_object
    if mesh.colours is None:
        return cleaned
    vertices = mesh.vertices @ T[:3, :3].T + T[:3, 3]
    pictures = SmallPictures(views, WIDTH)
    texture = paint_texture(vertices, mesh.faces, mesh.colours, pictures, masks)
    return replace(cleaned, mesh=replace(mesh, texture=texture))


def paint_texture(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    colours: UInt8[np.ndarray, "verts 3"],
    pictures: SmallPictures,
    masks: Masks,
    *,
    side: int = SIDE,
) -> Texture:
    """Unwrap and paint a mesh.

    Args:
        vertices, faces: world, metres.
        colours: mean colour of each vertex; of what no picture shows well it is the paint.
        pictures: of the views, about `WIDTH` wide.
        masks: silhouettes of the views.
        side: pixels along each side of the atlas.
    """
    uv = unwrap(vertices, faces, side)
    number, weights = texels(uv, side)
    view = best_views(vertices, faces, pictures, masks)
    rows, columns = np.nonzero(number >= 0)
    face, weight = number[rows, columns], weights[rows, columns]
    mean = np.einsum("nk,nkc->nc", weight, colours[faces[face]].astype(np.float32))
    places = np.einsum("nk,nkc->nc", weight, vertices[faces[face]])
    shown = mean.copy()
    for index in np.unique(view[view != NONE]):
        mine = view[face] == index
        off = _off(vertices, colours, pictures, int(index))
        paint = _sampled(pictures, int(index), places[mine], 0.0)
        shown[mine] = paint - np.einsum("nk,nkc->nc", weight[mine], off[faces[face[mine]]])
    image = np.zeros((side, side, 3), np.uint8)
    image[rows, columns] = np.rint(shown).clip(0, 255).astype(np.uint8)
    return Texture(uv, grown(image, number >= 0))


def unwrap(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"], side: int
) -> Uv:
    """Return each triangle's corners on the atlas; (0, 0) is its top left corner."""
    atlas = xatlas.Atlas()
    atlas.add_mesh(vertices.astype(np.float32), faces.astype(np.uint32))
    packing = xatlas.PackOptions()
    packing.padding, packing.resolution = _PADDING, side
    packing.bilinear = True
    atlas.generate(xatlas.ChartOptions(), packing)
    _, corners, uv = atlas.get_mesh(0)
    return np.asarray(uv, np.float64)[np.asarray(corners, np.int64)]


def texels(
    uv: Uv, side: int
) -> tuple[Int32[np.ndarray, "side side"], Float32[np.ndarray, "side side 3"]]:
    """The triangle of each pixel of the atlas (-1 where none is), and where in it the pixel lies."""
    number = np.full((side, side), -1, np.int32)
    places = uv * side - 0.5
    fixed = np.rint(places * 16).astype(np.int32)
    for face, triangle in enumerate(fixed):
        cv2.fillConvexPoly(number, triangle, face, cv2.LINE_8, 4)
    rows, columns = np.nonzero(number >= 0)
    a, b, c = np.moveaxis(places[number[rows, columns]], 1, 0)
    at = np.stack([columns, rows], axis=1)
    area = _cross(b - a, c - a)
    area = np.where(np.abs(area) < 1e-9, 1e-9, area)
    second, third = _cross(at - a, c - a) / area, _cross(b - a, at - a) / area
    weight = np.stack([1 - second - third, second, third], axis=1).clip(0, 1)
    weights = np.zeros((side, side, 3), np.float32)
    weights[rows, columns] = weight / weight.sum(axis=1, keepdims=True)
    return number, weights


def _cross(a: Float64[np.ndarray, "n 2"], b: Float64[np.ndarray, "n 2"]) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _off(
    vertices: Float64[np.ndarray, "verts 3"],
    colours: UInt8[np.ndarray, "verts 3"],
    pictures: SmallPictures,
    index: int,
) -> Float32[np.ndarray, "verts 3"]:
    """How much brighter a picture is at each vertex than the mean of all pictures."""
    return _sampled(pictures, index, vertices, _LEVEL) - colours.astype(np.float32)


def _sampled(
    pictures: SmallPictures, index: int, places: Float64[np.ndarray, "n 3"], blur: float
) -> Float32[np.ndarray, "n 3"]:
    """Colours of a picture at places of the world."""
    image = pictures.picture(index).colours
    if blur:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), blur), np.uint8)
    u, v, _ = projected(places, pictures.views[index].T_world_camera, pictures.matrix(index))
    return at_pixels(image, u, v, cv2.INTER_LINEAR).astype(np.float32)


def grown(image: UInt8[np.ndarray, "h w 3"], known: np.ndarray) -> UInt8[np.ndarray, "h w 3"]:
    """The atlas with its parts painted on beyond their rims, so that no gap shines through."""
    kernel = np.ones((3, 3), np.uint8)
    filled = known.astype(np.uint8)
    for _ in range(_GROWN):
        wider = cv2.dilate(filled, kernel)
        # The brightest neighbour stands in; further out nothing is ever seen.
        spread = cv2.dilate(image, kernel)
        image = np.where(((wider > 0) & (filled == 0))[..., None], spread, image)
        filled = wider
    return np.asarray(image, np.uint8)
