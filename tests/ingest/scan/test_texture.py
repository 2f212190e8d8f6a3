"""The texture of a scan's mesh: unwrapped, painted from pictures, and kept in its GLB."""

import cv2
import numpy as np
import pytest
import trimesh

from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.mesh import load_mesh
from ingest.scan.clean_mesh import CleanMesh, save_mesh
from ingest.scan.dense.stereo import SmallPictures
from ingest.scan.scan_types import ScanMesh, View
from ingest.scan.texture_atlas import NONE, add_texture, best_views, paint_texture, unwrap
from render.backends import open_renderer
from render.cameras import Camera
from render.scene import Drawable, Scene
from tests.ingest.scan.orbiting import SIZE, K, ring

SIDE = 256
RED, BLUE = (200, 30, 30), (30, 40, 190)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """A box, red where x > 0 and blue elsewhere, and pictures of it from around and above."""
    folder = tmp_path_factory.mktemp("film")
    box = trimesh.creation.box((0.4, 0.3, 0.5)).subdivide().subdivide().subdivide()
    vertices, faces = np.asarray(box.vertices, np.float64), np.asarray(box.faces, np.int64)
    red = vertices[faces].mean(axis=1)[:, 0] > 0
    parts = [
        Drawable(name, vertices, faces[pick], tuple(np.array(colour) / 255), casts_shadow=False)
        for name, pick, colour in (("red", red, RED), ("blue", ~red, BLUE))
    ]
    poses = ring([0.0, 0.0, 0.0], count=10, elevations=(0.3, 0.8))
    views = []
    with open_renderer(*SIZE) as renderer:
        renderer.show(Scene(parts))
        for index, T in enumerate(poses):
            file = folder / f"{index}.png"
            picture = renderer.color(Camera(T @ T_OPENCV_ARKIT_CAMERA, *K))
            cv2.imwrite(str(file), picture[..., ::-1])
            views.append(View(file.name, file, SIZE, K, T))
    colours = np.where((vertices[:, 0] > 0)[:, None], RED, BLUE).astype(np.uint8)
    return vertices, faces, colours, views


def test_each_triangle_is_painted_from_a_picture_that_faces_it(filmed):
    vertices, faces, _, views = filmed
    found = best_views(vertices, faces, SmallPictures(views, SIZE[0]), [None] * len(views))
    normals = np.cross(
        vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    )
    eyes = np.array([view.T_world_camera[:3, 3] for view in views])
    shown = found != NONE
    way = eyes[found[shown]] - vertices[faces[shown]].mean(axis=1)
    assert (np.einsum("ij,ij->i", normals[shown], way) > 0).all()
    assert shown[normals[:, 2] < -1e-9].mean() == 0  # Nobody sees its underside.
    assert shown[normals[:, 2] > -1e-9].mean() > 0.95


def test_parts_of_the_atlas_do_not_lie_on_each_other(filmed):
    vertices, faces, _, _ = filmed
    uv = unwrap(vertices, faces, SIDE)
    assert uv.shape == (len(faces), 3, 2)
    assert 0 <= uv.min() <= uv.max() <= 1
    a, b, c = np.moveaxis(uv, 1, 0)
    area = np.abs(np.linalg.det(np.stack([b - a, c - a], axis=1))) / 2
    drawn = np.zeros((SIDE, SIDE), np.int32)
    for triangle in np.rint((uv * SIDE - 0.5) * 16).astype(np.int32):
        one = np.zeros((SIDE, SIDE), np.uint8)
        cv2.fillConvexPoly(one, triangle, 1, cv2.LINE_8, 4)
        drawn += one
    assert area.sum() * SIDE**2 == pytest.approx((drawn > 0).sum(), rel=0.25)


def test_the_paint_is_what_pictures_show_and_stays_in_the_file(filmed, tmp_path):
    vertices, faces, colours, views = filmed
    texture = paint_texture(
        vertices, faces, colours, SmallPictures(views, SIZE[0]), [None] * len(views), side=SIDE
    )
    middle = texture.uv.mean(axis=1)
    row, column = (middle[:, ::-1] * SIDE - 0.5).round().astype(int).clip(0, SIDE - 1).T
    paint = texture.image[row, column].astype(int)
    x = vertices[faces].mean(axis=1)[:, 0]
    assert (paint[x > 0.04, 0] > paint[x > 0.04, 2]).all()
    assert (paint[x < -0.04, 0] < paint[x < -0.04, 2]).all()


def test_a_glb_holds_texture_and_one_closed_surface(filmed, tmp_path):
    vertices, faces, colours, views = filmed
    normals = np.asarray(trimesh.Trimesh(vertices, faces, process=False).vertex_normals, np.float64)
    mesh = ScanMesh(vertices, faces, colours, "box")
    clean = CleanMesh(mesh, normals, np.eye(4), np.ones(len(vertices), np.bool_), True)
    save_mesh(add_texture(clean, views, [None] * len(views)), tmp_path / "box.glb")
    read = load_mesh(tmp_path / "box.glb")
    assert read.texture is not None
    assert trimesh.Trimesh(read.vertices, read.faces, process=False).is_watertight
    assert len(read.faces) == len(faces)
    at = read.texture.uv.mean(axis=1)
    height, width = read.texture.image.shape[:2]
    column, row = (at * [width, height]).astype(int).T
    paint = read.texture.image[row.clip(0, height - 1), column.clip(0, width - 1)].astype(int)
    x = np.asarray(read.vertices)[read.faces].mean(axis=1)[:, 0]
    assert (paint[x > 0.04, 0] > paint[x > 0.04, 2]).mean() > 0.97
    assert (paint[x < -0.04, 0] < paint[x < -0.04, 2]).mean() > 0.97
