"""Depth by matching and the volume that depth maps fill, on pictures drawn in the test."""

from dataclasses import replace
from functools import cached_property

import igl
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.formats.still_images import load_millimetres
from ingest.scan.clean_mesh import main_piece
from ingest.scan.dense import stereo
from ingest.scan.dense.dense import dense_surface
from ingest.scan.dense.depth_maps import measure_depths, surface_points
from ingest.scan.dense.stereo import (
    SmallPictures,
    agreed,
    at_pixels,
    depth_range,
    matrix_for,
    neighbours,
    pixel_rays,
    smoothed,
    stereo_depth,
)
from ingest.scan.dense.volume import Box, Volume, grounded, seen_at, solid_surface
from ingest.scan.region import Aim
from ingest.scan.scan_types import Region
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from render.scene import Drawable
from tests.ingest.scan.orbiting import ring
from tests.simulator.scan_camera import PERFECT
from tests.simulator.scan_objects import carton
from tests.simulator.scan_scene import ScanScene, scan_scene
from tests.simulator.scan_views import true_views

WIDTH = 144


class Corner(ScanScene):
    """A carton in a room that is painted fast."""

    @cached_property
    def drawables(self):
        rng = np.random.default_rng(0)
        room = Drawable("room", *_square(2.5), uv=_square(0.5)[0][:, :2] + 0.5, texture=_paint(rng))
        walls = [
            replace(
                room, name=f"wall {k}", vertices=room.vertices @ R.T + [0, 0, 0.5] - 1.5 * R[:, 2]
            )
            for k, R in enumerate(
                Rotation.from_euler("zyx", [[90 * k, 90, 0] for k in range(4)], True).as_matrix()
            )
        ]
        T = self.T_world_object
        things = [
            replace(part, vertices=part.vertices @ T[:3, :3].T + T[:3, 3], texture=_paint(rng))
            for part in carton()
        ]
        return (room, *walls, *things)


def _square(half):
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * half
    return corners, np.array([[0, 1, 2], [0, 2, 3]])


def _paint(rng):
    return np.kron(rng.integers(20, 240, (96, 96, 3), np.uint8), np.ones((4, 4, 1), np.uint8))


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """A carton from 20 places: registered views with LiDAR, the scene, and where it is."""
    scene = Corner(**vars(scan_scene(1, "box")))
    middle = scene.T_world_object[:3, 3] + [0, 0, 0.2]
    poses = ring(middle, 20, 0.9, elevations=(0.45, 0.65)) @ T_OPENCV_ARKIT_CAMERA
    folder = tmp_path_factory.mktemp("filmed")
    registered = true_views(scene, poses, folder, width=WIDTH, depth=True, errors=PERFECT)
    floor = np.eye(4)
    floor[:2, 3] = scene.T_world_object[:2, 3]
    region = Region(floor, np.array([-0.4, -0.4, 0.0]), np.array([0.4, 0.4, 0.5]))
    return registered, scene, region, Aim(middle, 0.9, 0.0)


def _distance(points, vertices, faces):
    return np.sqrt(igl.point_mesh_squared_distance(points, vertices, faces)[0])


def _errors(surface, scene):
    """Metres from the surface to the truth, and the other way round."""
    T = scene.T_world_object
    truth = trimesh.Trimesh(scene.mesh.vertices @ T[:3, :3].T + T[:3, 3], scene.mesh.faces)
    kept = surface.faces[main_piece(surface.vertices, surface.faces)]
    there = _distance(surface.vertices[np.unique(kept)], truth.vertices, truth.faces)
    points = trimesh.sample.sample_surface(truth, 2000, seed=0)[0]
    back = _distance(points[points[:, 2] > 0.02], surface.vertices, kept)
    return there, back


def test_depth_of_a_view_is_what_was_drawn(filmed):
    registered, _, _, aim = filmed
    pictures = SmallPictures(registered.views, WIDTH)
    others = neighbours(registered.views, aim.point, 2, 4)
    assert others
    assert 2 not in others
    span = depth_range(registered.views[2], registered.points)
    depth = stereo_depth(pictures, 2, others, span)
    drawn = load_millimetres(registered.views[2].depth)
    rays = pixel_rays(drawn.shape, np.eye(3))[..., :2].reshape(-1, 2).T
    scale = WIDTH / drawn.shape[1]
    own = at_pixels(depth, *((rays + 0.5) * scale - 0.5).astype(np.float32), 0)
    # The middle of the picture, where the neighbours look too.
    inner = np.zeros(drawn.shape, bool)
    inner[40:150, 50:200] = True
    known = inner.ravel() & (drawn.ravel() > 0) & (own > 0)
    assert known.sum() > 0.7 * inner.sum()
    assert np.median(np.abs(own - drawn.ravel())[known]) < 0.02


def test_a_surface_from_pictures_alone(filmed, tmp_path):
    registered, scene, region, aim = filmed
    depths = measure_depths(registered, aim, tmp_path, method="stereo")
    surface = dense_surface(depths, region, voxel=0.008)
    there, back = _errors(surface, scene)
    assert np.median(there) < 0.012
    assert (back < 0.02).mean() > 0.8
    assert surface.colours.std() > 10


def test_depth_of_the_phone_makes_the_surface_better(filmed, tmp_path):
    registered, scene, region, aim = filmed
    told = []
    depths = measure_depths(registered, aim, tmp_path, method="depth")
    surface = dense_surface(depths, region, voxel=0.008, progress=lambda *at: told.append(at))
    there, back = _errors(surface, scene)
    assert np.median(there) < 0.005
    assert (back < 0.01).mean() > 0.85
    assert trimesh.Trimesh(surface.vertices, surface.faces, process=False).is_watertight
    assert surface.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-5)
    assert told[-1] == ("colours", 1.0)
    assert ("fusion", 1.0) in told


def test_a_scan_goes_on_where_it_was_stopped(filmed, tmp_path, monkeypatch):
    registered, _, _, aim = filmed
    pictures = SmallPictures(registered.views, 48)
    measured, real, patience = [], stereo.stereo_depth, [5]

    def counted(pictures, index, *rest):
        if len(measured) == patience[0]:
            raise KeyboardInterrupt
        measured.append(index)
        return real(pictures, index, *rest)

    monkeypatch.setattr(stereo, "stereo_depth", counted)
    monkeypatch.setattr(stereo, "_WORKERS", 1)
    with pytest.raises(KeyboardInterrupt):
        stereo.stereo_maps(registered, pictures, aim, tmp_path, lambda *_: None)
    patience[0] = 1000
    maps = stereo.stereo_maps(registered, pictures, aim, tmp_path, lambda *_: None)
    assert sorted(measured) == list(range(len(registered.views)))
    measured.clear()
    again = stereo.stereo_maps(registered, pictures, aim, tmp_path, lambda *_: None)
    assert measured == []
    assert all(np.array_equal(a, b) for a, b in zip(maps, again, strict=True))


def test_places_that_depth_maps_agree_about_and_not_what_one_of_them_sees(filmed, tmp_path):
    registered, scene, _, aim = filmed
    depths = measure_depths(registered, aim, tmp_path, method="depth")
    maps = [depth.copy() for depth in depths.kinds[0]]
    # Four views are mistaken: they see something right before them.
    for view in range(0, 20, 5):
        maps[view][:] = 0.3
    places = surface_points(replace(depths, kinds=(maps,)), aim)
    T = inverse(scene.T_world_object)
    own = places @ T[:3, :3].T + T[:3, 3]
    on = _distance(own, scene.mesh.vertices, scene.mesh.faces) < 0.02
    assert np.ptp(own[on & (own[:, 2] > 0.03)], axis=0) == pytest.approx(
        [0.5, 0.36, 0.37], abs=0.05
    )
    assert (on | (own[:, 2] < 0.03)).mean() > 0.98


def test_what_was_asked_for_and_is_not_there(filmed, tmp_path):
    registered, _, _, aim = filmed
    blind = replace(registered, views=tuple(replace(v, depth=None) for v in registered.views))
    with pytest.raises(InputError) as refused:
        measure_depths(blind, aim, tmp_path, method="depth")
    assert refused.value.code == "scan-no-depth"
    gone = replace(registered.views[0], file=tmp_path / "gone.png")
    with pytest.raises(InputError) as refused:
        SmallPictures([gone], WIDTH).picture(0)
    assert refused.value.code == "scan-picture"


def test_an_empty_box_has_no_surface(filmed, tmp_path):
    registered, _, region, aim = filmed
    air = replace(region, low=np.array([0.3, 0.3, 0.0]), high=np.array([0.4, 0.4, 0.2]))
    depths = measure_depths(registered, aim, tmp_path, method="depth")
    with pytest.raises(InputError) as refused:
        dense_surface(depths, air, voxel=0.008)
    assert refused.value.code == "scan-no-surface"


def test_smoothing_fills_what_says_nothing_and_keeps_an_edge():
    costs = np.full((40, 40, 20), 60, np.uint8)
    grey = np.full((40, 40), 50, np.uint8)
    grey[:, 20:] = 200
    costs[:, :20, 5] = 0
    costs[:, 20:, 15] = 0
    costs[15:20, 5:10] = 30
    best = smoothed(costs, grey).argmin(axis=2)
    assert (best[:, :20] == 5).all()
    assert (best[:, 20:] == 15).all()


def test_a_depth_that_others_contradict_is_dropped():
    matrix = np.array([[100.0, 0, 31.5], [0, 100.0, 23.5], [0, 0, 1]])
    wall = np.full((48, 64), 2.0, np.float32)
    wrong = wall.copy()
    wrong[10:20, 10:20] = 1.5
    beside = np.eye(4)
    beside[0, 3] = 0.1
    others = [(wall, matrix, beside), (wall, matrix, inverse(beside))]
    kept = agreed(wrong, matrix, others, within=0.01, enough=2)
    assert (kept[10:20, 10:20] == 0).all()
    assert np.allclose(kept[30:40, 10:50], 2.0)


@pytest.fixture(scope="module")
def ball():
    """A volume that sees half a ball of 15 cm on a floor, from all around."""
    matrix = np.array([[150.0, 0, 79.5], [0, 150.0, 59.5], [0, 0, 1]])
    volume = Volume(
        Box.of(np.array([-0.25, -0.25, 0.0]), np.array([0.25, 0.25, 0.25]), 0.008), 0.024
    )
    for T in ring([0, 0, 0.08], count=20, distance=1.0, elevations=(0.4, 0.9)):
        rays = pixel_rays((120, 160), matrix).astype(float) @ T[:3, :3].T
        eye = T[:3, 3]
        square, half = (rays**2).sum(-1), rays @ eye
        root = half**2 - square * (eye @ eye - 0.15**2)
        ground = -eye[2] / np.minimum(rays[..., 2], -1e-6)
        hit = (-half - np.sqrt(np.maximum(root, 0))) / square
        up = eye[2] + hit * rays[..., 2] > 0
        depth = np.where((root > 0) & up, hit, np.where(rays[..., 2] < -1e-3, ground, 8.0))
        volume.add(depth.astype(np.float32), matrix, inverse(T))
    return volume


def test_a_volume_has_the_shape_and_stands_flat_on_the_floor(ball):
    vertices, faces = solid_surface(grounded(ball.field(), ball.box), ball.box)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(2 / 3 * np.pi * 0.15**3, rel=0.05)
    above = vertices[vertices[:, 2] > 0.012]
    assert np.abs(np.linalg.norm(above, axis=1) - 0.15).max() < 0.008
    assert vertices[:, 2].min() == pytest.approx(0.0, abs=1e-5)
    assert seen_at(above, ball.seen(), ball.box, 2.0).mean() > 0.95


def test_intrinsics_follow_the_size_of_the_picture(filmed):
    view = filmed[0].views[0]
    half = matrix_for(view, (view.size[0] // 2, view.size[1] // 2))
    point = np.array([0.1, -0.05, 1.0])
    fx, fy, cx, cy = view.intrinsics
    full = np.array([fx * 0.1 + cx, fy * -0.05 + cy])
    assert np.allclose(((half @ point)[:2] + 0.5) * 2, full + 0.5)
