"""Signed distances: exact on shapes with a formula, sane on what scanners make."""

from functools import cache
from pathlib import Path

import igl
import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.errors import InputError
from omomo_core.geometry.distance_field import DistanceField, distance_field
from omomo_core.geometry.geometry_config import DISTANCE_FIELD
from omomo_core.motion import ObjectMesh

SIZE = np.array([0.4, 0.3, 0.6])
RADIUS, LENGTH = 0.0125, 0.8


def mesh_of(solid: trimesh.Trimesh) -> ObjectMesh:
    return ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "thing")


def box() -> trimesh.Trimesh:
    """Many faces, so that some of them can be taken away or turned."""
    solid = trimesh.creation.box(SIZE)
    for _ in range(4):
        solid = solid.subdivide()
    return solid


def to_box(p: np.ndarray) -> np.ndarray:
    q = np.abs(p) - SIZE / 2
    return np.linalg.norm(q.clip(0), axis=-1) + q.max(axis=-1).clip(max=0)


def to_sphere(p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(p, axis=-1) - 0.2


def to_pole(p: np.ndarray) -> np.ndarray:
    on_axis = np.zeros_like(p)
    on_axis[..., 2] = p[..., 2].clip(-LENGTH / 2, LENGTH / 2)
    return np.linalg.norm(p - on_axis, axis=-1) - RADIUS


def pole() -> trimesh.Trimesh:
    solid = trimesh.creation.capsule(LENGTH, RADIUS, count=(24, 24))
    solid.apply_translation(-solid.bounds.mean(axis=0))
    return solid


SHAPES = {
    "box": (box, to_box),
    "sphere": (lambda: trimesh.creation.icosphere(4, 0.2), to_sphere),
    "pole": (pole, to_pole),
}
shapes = pytest.mark.parametrize("shape", SHAPES)


@cache
def field_of(shape: str) -> DistanceField:
    return distance_field(mesh_of(SHAPES[shape][0]()))


def around(solid: trimesh.Trimesh, spread: float, seed: int = 0, count: int = 2000) -> np.ndarray:
    """Points near the surface."""
    found = trimesh.sample.sample_surface(solid, count, seed=seed)[0]
    return found + np.random.default_rng(seed).normal(0, spread, found.shape)


def at(field: DistanceField, points: np.ndarray) -> np.ndarray:
    return field.at(torch.from_numpy(points)).double().numpy()


@shapes
def test_distances_near_a_shape_are_those_of_its_formula(shape: str):
    build, formula = SHAPES[shape]
    points = around(build(), 0.01)
    error = np.abs(at(field_of(shape), points) - formula(points))
    assert error.mean() < 0.001
    # Edges and the middle of thin parts are rounded off by the grid.
    assert error.max() < 0.5 * field_of(shape).spacing


def grid(field: DistanceField) -> np.ndarray:
    index = np.indices(field.values.shape).reshape(3, -1).T
    return field.low.double().numpy() + field.spacing * index


@shapes
def test_every_point_of_the_grid_is_on_the_right_side(shape: str):
    field = field_of(shape)
    true = SHAPES[shape][1](grid(field))
    clear = np.abs(true) > 0.001
    found = field.values.numpy().reshape(-1)
    np.testing.assert_array_equal((found < 0)[clear], (true < 0)[clear])


@pytest.mark.parametrize("steps", [20, 21])
def test_walls_along_the_grid_keep_their_sides_apart(steps: int):
    # On points of the grid, and in the middle between them.
    size = 0.01 * np.array([steps, 30, 14])
    field = distance_field(mesh_of(trimesh.creation.box(size)), spacing=0.01)
    beyond = (np.abs(grid(field)) - size / 2).max(axis=1)
    found = field.values.numpy().reshape(-1)
    assert (found[beyond < -1e-6] < 0).all()
    assert (found[beyond > 1e-6] > 0).all()


@shapes
def test_away_is_the_slope_of_the_formula(shape: str):
    build, formula = SHAPES[shape]
    solid = build()
    on, face = trimesh.sample.sample_surface(solid, 500, seed=1)
    points = on + 0.01 * np.asarray(solid.face_normals)[face]
    eye = 1e-4 * np.eye(3)
    slope = np.stack([formula(points + e) - formula(points - e) for e in eye], axis=-1)
    slope /= np.linalg.norm(slope, axis=-1, keepdims=True)
    away = field_of(shape).away(torch.from_numpy(points)).double().numpy()
    np.testing.assert_allclose(np.linalg.norm(away, axis=-1), 1, atol=1e-5)
    turned = np.degrees(np.arccos((away * slope).sum(axis=-1).clip(-1, 1)))
    assert np.median(turned) < 2
    assert turned.max() < 40


def test_any_number_of_points_may_be_asked_for():
    assert field_of("box").at(torch.zeros(7, 5, 3)).shape == (7, 5)
    assert field_of("box").at(torch.zeros(0, 3)).shape == (0,)
    assert field_of("box").away(torch.zeros(0, 3)).shape == (0, 3)


@given(seed=st.integers(0, 2**31), far=st.floats(0.2, 20))
@settings(max_examples=15)
def test_beyond_the_grid_it_is_a_lower_bound_and_leads_away(seed: int, far: float):
    points = np.random.default_rng(seed).normal(0, far, (200, 3))
    points = points[to_box(points) > 0.2]
    exact, found = to_box(points), at(field_of("box"), points)
    assert (found < exact + 1e-3 + 1e-5 * far).all()
    assert (found > 0.7 * exact).all()
    away = field_of("box").away(torch.from_numpy(points)).double().numpy()
    ahead = to_box(points + 0.01 * away) - exact
    assert (ahead > 0.005).all()


@given(seed=st.integers(0, 2**31))
@settings(max_examples=15)
def test_it_is_continuous_and_no_steeper_than_a_distance(seed: int):
    rng = np.random.default_rng(seed)
    a = rng.uniform(-0.8, 0.8, (500, 3))
    step = rng.normal(0, 0.004, a.shape)
    change = np.abs(at(field_of("box"), a + step) - at(field_of("box"), a))
    assert (change <= np.sqrt(3) * np.linalg.norm(step, axis=-1) + 1e-4).all()


@given(shift=st.tuples(*[st.floats(-3, 3)] * 3))
@settings(max_examples=4)
def test_where_the_origin_is_does_not_matter(shift: tuple[float, float, float]):
    solid = trimesh.creation.icosphere(2, 0.2)
    points = around(solid, 0.01, count=200)
    moved = solid.copy().apply_translation(shift)
    fields = [distance_field(mesh_of(s), spacing=0.025) for s in (solid, moved)]
    np.testing.assert_allclose(at(fields[1], points + shift), at(fields[0], points), atol=0.003)


def turned_faces(solid: trimesh.Trimesh, which: np.ndarray) -> trimesh.Trimesh:
    faces = np.array(solid.faces)
    faces[which] = faces[which, ::-1]
    return trimesh.Trimesh(solid.vertices, faces, process=False)


def double_sided(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(
        np.concatenate([solid.vertices, solid.vertices]),
        np.concatenate([solid.faces, solid.faces[:, ::-1] + len(solid.vertices)]),
        process=False,
    )


SCANNED = {
    "inside out": lambda s: turned_faces(s, np.arange(len(s.faces))),
    "some faces turned": lambda s: turned_faces(s, np.arange(0, len(s.faces), 7)),
    "every face alone": lambda s: trimesh.Trimesh(
        s.triangles.reshape(-1, 3), np.arange(3 * len(s.faces)).reshape(-1, 3), process=False
    ),
    "double-sided": double_sided,
    "a sheet twice": lambda s: trimesh.util.concatenate(
        [s, s.copy().apply_transform(np.diag([0.99, 0.99, 0.99, 1]))]
    ),
    "a fin on it": lambda s: trimesh.Trimesh(
        np.concatenate([s.vertices, [[0.3, 0, 0]]]),
        np.concatenate([s.faces, [[*s.faces[0][:2], len(s.vertices)]]]),
        process=False,
    ),
}


@pytest.mark.parametrize("fault", SCANNED)
def test_what_is_wrong_with_a_mesh_does_not_change_its_inside(fault: str):
    field = distance_field(mesh_of(SCANNED[fault](box())), spacing=0.02)
    points = around(box(), 0.04)
    clear = np.abs(to_box(points)) > 0.012
    np.testing.assert_array_equal((at(field, points) < 0)[clear], (to_box(points) < 0)[clear])


def test_two_parts_of_which_one_is_inside_out():
    turned = box()
    turned = turned_faces(turned, np.arange(len(turned.faces))).apply_translation([0.6, 0, 0])
    field = distance_field(mesh_of(trimesh.util.concatenate([box(), turned])))
    middles = np.array([[0, 0, 0], [0.3, 0, 0], [0.6, 0, 0]])
    np.testing.assert_allclose(at(field, middles), [-0.15, 0.1, -0.15], atol=0.02)


def test_a_noisy_scan_with_holes_keeps_its_inside():
    rng = np.random.default_rng(0)
    solid = trimesh.creation.icosphere(4, 0.2)
    rough = np.asarray(solid.vertices) + rng.normal(0, 0.002, solid.vertices.shape)
    centres = np.asarray(solid.triangles_center)
    holes = centres[rng.integers(0, len(centres), 8)]
    kept = np.linalg.norm(centres[:, None] - holes, axis=-1).min(axis=1) > 0.03
    assert 0.02 < 1 - kept.mean() < 0.08
    scan = trimesh.Trimesh(rough, solid.faces[kept], process=False)
    field = distance_field(mesh_of(scan))
    points = around(scan, 0.04)
    found, true = at(field, points), to_sphere(points)
    clear = np.abs(true) > 0.01
    assert ((found < 0) == (true < 0))[clear].mean() > 0.995
    assert np.abs(found - true)[clear].mean() < 0.003
    assert at(field, np.zeros((1, 3)))[0] < -0.17


def test_near_a_hole_the_sides_are_those_of_the_winding_number():
    solid = trimesh.creation.icosphere(4, 0.2)
    solid.update_faces(np.linalg.norm(solid.triangles_center - [0.2, 0, 0], axis=1) > 0.09)
    field = distance_field(mesh_of(solid), spacing=0.012)
    near = np.abs(to_sphere(grid(field))) < 0.03
    turns = igl.winding_number(
        np.asarray(solid.vertices), np.asarray(solid.faces), grid(field)[near]
    )
    found = field.values.numpy().reshape(-1)[near] < 0
    assert (found == (np.abs(turns) > 0.5)).mean() > 0.998


def test_the_inside_of_a_thin_scanned_part_does_not_run_out_of_its_holes():
    solid = trimesh.creation.box((0.04, 0.6, 0.4)).subdivide_to_size(0.02)
    middles = np.asarray(solid.triangles_center)
    holes = np.array([[0.02, y, z] for y in (-0.2, 0.0, 0.2) for z in (-0.1, 0.1)])
    solid.update_faces(np.linalg.norm(middles[:, None] - holes, axis=-1).min(axis=1) > 0.025)
    field = distance_field(mesh_of(solid))
    low, high = solid.bounds
    within = ((grid(field) > low) & (grid(field) < high)).all(axis=1)
    turns = igl.winding_number(
        np.asarray(solid.vertices), np.asarray(solid.faces), grid(field)[within]
    )
    found = field.values.numpy().reshape(-1)[within] < 0
    assert (found == (turns > 0.5)).mean() > 0.995


@pytest.mark.parametrize("shape", ["whole", "with a hole"])
def test_exact_distances_have_the_side_of_the_winding_number(shape: str):
    solid = trimesh.creation.icosphere(4, 0.2)
    if shape == "with a hole":
        solid.update_faces(np.linalg.norm(solid.triangles_center - [0.2, 0, 0], axis=1) > 0.09)
    points = np.random.default_rng(0).normal(size=(4000, 3))
    points *= np.linspace(0.15, 0.6, 4000)[:, None] / np.linalg.norm(points, axis=1, keepdims=True)
    found, _ = distance_field(mesh_of(solid)).exact(torch.from_numpy(points))
    turns = igl.winding_number(np.asarray(solid.vertices), np.asarray(solid.faces), points)
    same = (found.numpy() < 0) == (np.abs(turns) > 0.5)
    assert same.all() if shape == "whole" else same.mean() > 0.998


def test_an_open_box_holds_its_deep_end_and_not_its_mouth():
    solid = box()
    lid = np.asarray(solid.triangles_center)[:, 2] > SIZE[2] / 2 - 1e-6
    solid.update_faces(~lid)
    field = distance_field(mesh_of(solid))
    low, mouth, beyond = at(field, np.array([[0, 0, -0.2], [0, 0, 0.34], [0, 0, 0.4]]))
    assert low == pytest.approx(-0.1, abs=0.005)
    assert 0 < mouth < beyond


def test_an_open_sheet_has_no_inside():
    solid = box()
    solid.update_faces(np.asarray(solid.triangles_center)[:, 2] > SIZE[2] / 2 - 1e-6)
    field = distance_field(mesh_of(solid))
    assert field.values.min() >= 0
    assert at(field, np.array([[0.05, 0.02, 0.2]]))[0] == pytest.approx(0.1, abs=0.002)


def test_a_thin_plate_and_a_pole_have_an_inside():
    plate = distance_field(mesh_of(trimesh.creation.box((1.4, 0.8, 0.02))))
    across = np.linspace(-0.05, 0.05, 41)
    points = np.stack([np.full(41, 0.1), np.full(41, 0.1), across], axis=-1)
    found, true = at(plate, points), np.abs(across) - 0.01
    np.testing.assert_allclose(found, true, atol=plate.spacing / 2)
    np.testing.assert_allclose(found[true > -0.002], true[true > -0.002], atol=0.003)
    assert found.min() < -0.004
    assert at(field_of("pole"), np.zeros((1, 3)))[0] < -RADIUS / 2


def test_finely_a_thin_pole_is_as_deep_as_it_is_on_a_coarse_grid():
    field = distance_field(mesh_of(trimesh.creation.box((0.02, 0.02, 0.6))), spacing=0.02)
    points = torch.tensor([[0.0, 0.0, 0.0], [0.005, 0.0, 0.1], [0.1, 0.0, 0.0]])
    np.testing.assert_allclose(field.fine(points), [-0.01, -0.005, 0.09], atol=2e-3)


@pytest.mark.parametrize("size", [0.05, 0.5, 2.0, 3.5])
def test_grids_are_neither_huge_nor_coarse(size: float):
    field = distance_field(mesh_of(trimesh.creation.box((size, size / 3, size / 3))))
    assert DISTANCE_FIELD.finest <= field.spacing <= DISTANCE_FIELD.coarsest
    assert field.values.numel() < 900_000
    assert (field.low.numpy() < -np.array([size, size / 3, size / 3]) / 2 - 0.149).all()
    np.testing.assert_allclose(field.high, -field.low, atol=1e-5)


@pytest.mark.parametrize("name", ["largetable", "woodchair"])
def test_real_scans(shared: Path, name: str):
    path = shared / "data" / "omomo_clips" / "meshes" / f"{name}.npz"
    with np.load(path) as file:
        vertices, faces = file["vertices"].astype(float), file["faces"].astype(np.int64)
    field = distance_field(ObjectMesh(vertices, faces, name))
    solid = trimesh.Trimesh(vertices, faces, process=False)
    points = around(solid, 0.03)
    exact = igl.signed_distance(
        points, vertices, faces, sign_type=igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
    )[0]
    error = np.abs(at(field, points) - exact)
    assert np.median(error) < 0.001
    assert np.quantile(error, 0.95) < 0.005
    outside = exact > 0.01
    assert (at(field, points)[outside] > 0).all()


def test_a_mesh_without_any_area_is_refused() -> None:
    """It would end the process in a library."""
    lines = np.array([[0.0, 0, 0], [0.3, 0, 0], [0.6, 0, 0]])
    with pytest.raises(InputError, match="mesh-empty"):
        distance_field(ObjectMesh(lines, np.array([[0, 1, 2]]), "lines"))
