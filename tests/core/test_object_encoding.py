"""BPS: exact distances, one tree for all frames, and the training grid close to it."""

import numpy as np
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from omomo_core.geometry.object_features import basis, encode
from omomo_core.geometry.surface import sample_surface
from omomo_core.learning.training.corpus import ShapeGrids
from omomo_core.motion import ObjectMesh


def box(extents: tuple[float, float, float] = (0.4, 0.3, 0.6)) -> ObjectMesh:
    solid = trimesh.creation.box(extents)
    return ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")


def test_basis_is_the_published_one():
    points = basis()
    assert points.shape == (1024, 3)
    np.testing.assert_allclose(points[0], [-0.4558, 0.4823, -0.0285], atol=1e-4)
    assert np.linalg.norm(points, axis=1).max() <= 1.0
    np.testing.assert_array_equal(basis(256), points[:256])


@given(seed=st.integers(0, 100))
@settings(max_examples=10)
def test_turning_the_basis_equals_turning_the_object(seed: int):
    R = Rotation.random(3, random_state=seed).as_matrix()
    surface = sample_surface(box(), 500)
    fast = encode(surface.tree, surface.centre, R, 64)
    for frame in range(3):
        world = (surface.points - surface.centre) @ R[frame].T
        distance, _ = KDTree(world).query(basis(64))
        np.testing.assert_allclose(np.linalg.norm(fast[frame], axis=1), distance, atol=1e-9)
        on_surface = basis(64) + fast[frame]
        assert KDTree(world).query(on_surface)[0].max() < 1e-9


def test_the_same_mesh_gives_the_same_surface():
    np.testing.assert_array_equal(sample_surface(box()).points, sample_surface(box()).points)


def test_training_grid_agrees_with_the_exact_code():
    mesh = box()
    surface = sample_surface(mesh)
    R = Rotation.random(4, random_state=1).as_matrix()
    exact = encode(surface.tree, surface.centre, R, 256)
    lookup = ShapeGrids([mesh]).lookup(torch.tensor([1]), torch.tensor([False]), 256)
    grid = lookup(torch.from_numpy(R[None].astype(np.float32)))[0].numpy()
    # Both must point at the surface; the grid's point may be up to half a cell from the nearest.
    gap = np.abs(np.linalg.norm(grid, axis=-1) - np.linalg.norm(exact, axis=-1))
    assert np.median(gap) < 0.005
    assert gap.max() < 0.08


def test_a_mirrored_object_is_the_mirror_image():
    mesh = box()
    mesh = ObjectMesh(
        mesh.vertices + np.array([0.1, 0.2, 0.0]) * (mesh.vertices > 0), mesh.faces, "wedge"
    )
    flipped = ObjectMesh(mesh.vertices * [-1, 1, 1], mesh.faces[:, ::-1].copy(), "flipped")
    grids = ShapeGrids([mesh, flipped])
    R = torch.eye(3).expand(1, 1, 3, 3)
    a = grids.lookup(torch.tensor([1]), torch.tensor([True]), 256)(R)
    b = grids.lookup(torch.tensor([2]), torch.tensor([False]), 256)(R)
    assert (a.norm(dim=-1) - b.norm(dim=-1)).abs().median() < 0.01
