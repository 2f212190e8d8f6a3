"""From a measured surface to the mesh of an object."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from pygltflib import GLTF2
from scipy.spatial.transform import Rotation

from ingest.mesh import load_mesh
from ingest.scan.clean_mesh import clean, save_mesh
from ingest.scan.mesh_sources import read_scan_mesh
from ingest.scan.scan_types import Region
from omomo_core.errors import InputError
from omomo_core.geometry.distance_field import distance_field
from omomo_core.motion import ObjectMesh

SIZE = np.array([0.4, 0.2, 0.3])
T_WORLD_OBJECT = np.eye(4)
T_WORLD_OBJECT[:3, :3] = Rotation.from_euler("z", 20, degrees=True).as_matrix()
T_WORLD_OBJECT[:3, 3] = [0.7, -0.4, 0.1]


def _floor():
    T = np.eye(4)
    T[:3, 3] = [0.6, -0.5, 0.1]
    return Region(T, np.array([-0.5, -0.5, 0.0]), np.array([0.7, 0.7, 0.6]))


def _carton(edge=0.02):
    """A box in the world, finely meshed."""
    box = trimesh.creation.box(SIZE)
    box.apply_translation([0, 0, SIZE[2] / 2])
    return box.subdivide_to_size(edge).apply_transform(T_WORLD_OBJECT)


def _cleaned(*parts, **options):
    whole = trimesh.util.concatenate(parts)
    return clean(
        np.asarray(whole.vertices),
        np.asarray(whole.faces, np.int64),
        None,
        _floor(),
        "carton",
        **options,
    )


def _notes(cleaned):
    return {note.name: note.severity for note in cleaned.mesh.notes}


def test_the_object_stands_at_its_origin():
    cleaned = _cleaned(_carton())
    low, high = cleaned.mesh.vertices.min(axis=0), cleaned.mesh.vertices.max(axis=0)
    assert np.allclose(low, [-0.2, -0.1, 0.0], atol=1e-3)
    assert np.allclose(high, [0.2, 0.1, 0.3], atol=1e-3)
    assert np.allclose(cleaned.T_world_object, T_WORLD_OBJECT, atol=2e-3)
    assert cleaned.watertight
    assert _notes(cleaned) == {"box": "ok", "unseen": "ok", "closed": "ok"}


def test_crumbs_and_cavities_go_and_a_part_that_is_broken_off_stays():
    crumb = trimesh.creation.icosphere(1, 0.01).apply_translation([0.9, -0.4, 0.2])
    cavity = trimesh.creation.box([0.2, 0.1, 0.1]).apply_translation([0.7, -0.4, 0.25])
    cavity.invert()
    pole = trimesh.creation.cylinder(0.01, 0.3).apply_translation([0.7, -0.4, 0.1 + 0.3 + 0.16])
    cleaned = _cleaned(_carton(), crumb, cavity, pole)
    assert cleaned.mesh.vertices[:, 2].max() == pytest.approx(0.61, abs=2e-3)
    solid = trimesh.Trimesh(cleaned.mesh.vertices, cleaned.mesh.faces)
    assert solid.body_count == 2
    assert solid.volume == pytest.approx(np.prod(SIZE) + np.pi * 0.01**2 * 0.3, rel=0.01)


def test_a_mesh_is_made_small_and_keeps_its_shape_and_its_colours():
    ball = trimesh.creation.icosphere(5, 0.2).apply_translation([0.7, -0.4, 0.3])
    red = np.where(ball.vertices[:, :1] > 0.7, [[200, 10, 10]], [[10, 10, 200]]).astype(np.uint8)
    seen = ball.vertices[:, 2] > 0.2
    cleaned = clean(
        np.asarray(ball.vertices),
        np.asarray(ball.faces, np.int64),
        red,
        _floor(),
        "ball",
        seen=np.asarray(seen),
        most=2000,
    )
    mesh = cleaned.mesh
    assert 1900 < len(mesh.vertices) <= 2010
    assert cleaned.watertight
    assert np.allclose(np.linalg.norm(mesh.vertices - [0, 0, 0.2], axis=1), 0.2, atol=5e-3)
    world = mesh.vertices @ cleaned.T_world_object[:3, :3].T + cleaned.T_world_object[:3, 3]
    away = np.abs(world[:, 0] - 0.7) > 0.02
    assert ((mesh.colours[:, 0] > 100) == (world[:, 0] > 0.7))[away].all()
    assert cleaned.seen.mean() == pytest.approx(0.75, abs=0.03)
    outwards = np.einsum("ij,ij->i", cleaned.normals, mesh.vertices - [0, 0, 0.2])
    assert (outwards > 0.18).all()


def test_small_holes_are_closed_and_large_ones_told():
    carton = _carton()
    centres = carton.triangles_center - T_WORLD_OBJECT[:3, 3]
    small = np.linalg.norm(centres - [0, 0, 0.3], axis=1) < 0.012
    carton.update_faces(~small)
    assert not carton.is_watertight
    assert _cleaned(carton).watertight
    carton.update_faces(carton.triangles_center[:, 2] > 0.11)
    cleaned = _cleaned(carton)
    assert not cleaned.watertight
    assert _notes(cleaned)["closed"] == "warn"


def test_a_mesh_that_is_not_closed_still_has_an_inside_for_the_generation():
    carton = _carton()
    carton.update_faces(carton.triangles_center[:, 2] > 0.11)
    mesh = _cleaned(carton).mesh
    field = distance_field(ObjectMesh(mesh.vertices, mesh.faces, mesh.name))
    at = field.at(torch.tensor([[0.0, 0.0, 0.2], [0.3, 0.0, 0.2]]))
    assert at[0] == pytest.approx(-0.09, abs=0.01)
    assert at[1] == pytest.approx(0.1, abs=0.01)


def test_what_the_pictures_do_not_show_and_what_the_box_cuts_is_told():
    carton = _carton()
    cleaned = clean(
        np.asarray(carton.vertices),
        np.asarray(carton.faces, np.int64),
        None,
        replace(_floor(), high=np.array([0.7, 0.7, 0.302])),
        "touching",
        seen=np.asarray(carton.vertices[:, 2] > 0.3),
    )
    assert _notes(cleaned) == {"box": "warn", "unseen": "bad", "closed": "ok"}


@pytest.mark.parametrize("kind", [".glb", ".ply", ".obj"])
def test_a_saved_mesh_is_read_back_as_it_was(tmp_path, kind):
    cleaned = _cleaned(_carton(), most=2000)
    painted = np.tile(np.array([[10, 200, 30]], np.uint8), (len(cleaned.mesh.vertices), 1))
    cleaned = replace(cleaned, mesh=replace(cleaned.mesh, colours=painted))
    path = tmp_path / f"carton{kind}"
    save_mesh(cleaned, path)
    again = load_mesh(path)
    assert np.allclose(again.vertices.min(axis=0), [-0.2, -0.1, 0.0], atol=1e-3)
    assert np.allclose(again.vertices.max(axis=0), [0.2, 0.1, 0.3], atol=1e-3)
    assert len(again.faces) == len(cleaned.mesh.faces)
    bytes_ = [1, 147, 3] if kind == ".glb" else [10, 200, 30]  # glTF's are linear
    assert trimesh.load_mesh(path).visual.vertex_colors[:, :3].mean(axis=0) == pytest.approx(
        bytes_, abs=1
    )
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_impossible_requests_are_refused(tmp_path):
    with pytest.raises(InputError) as refused:
        _cleaned(_carton(), most=5)
    assert refused.value.code == "scan-vertices"
    with pytest.raises(InputError) as refused:
        save_mesh(_cleaned(_carton()), tmp_path / "carton.step")
    assert refused.value.code == "mesh-format"
    with pytest.raises(InputError) as refused:
        save_mesh(_cleaned(_carton()), tmp_path / "nowhere" / "carton.glb")
    assert refused.value.code == "output-not-writable"


@pytest.mark.parametrize("kind", ["glb", "ply", "obj"])
def test_colours_are_linear_in_gltf_and_srgb_elsewhere(tmp_path: Path, kind: str):
    """As the bytes of the file have them, not as a reader of ours."""
    cleaned = _cleaned(_carton())
    count = len(cleaned.mesh.vertices)
    grey = np.full((count, 3), 128, np.uint8)
    path = tmp_path / f"carton.{kind}"
    save_mesh(replace(cleaned, mesh=replace(cleaned.mesh, colours=grey, texture=None)), path)
    if kind == "glb":
        file = GLTF2().load(str(path))
        assert file is not None
        accessor = file.accessors[file.meshes[0].primitives[0].attributes.COLOR_0]
        first = file.bufferViews[accessor.bufferView].byteOffset + (accessor.byteOffset or 0)
        assert (accessor.componentType, accessor.normalized) == (5121, True)
        assert file.binary_blob()[first : first + 4] == bytes([55, 55, 55, 255])
    elif kind == "ply":
        there = trimesh.load_mesh(path, process=False).visual.vertex_colors
        np.testing.assert_array_equal(there[0, :3], 128)
    else:
        words = next(
            line for line in path.read_text().splitlines() if line.startswith("v ")
        ).split()
        np.testing.assert_allclose(np.array(words[4:7], float), 128 / 255, atol=2e-3)
    colours = read_scan_mesh(path).colours
    assert colours is not None
    assert np.abs(colours.astype(int) - 128).max() <= 1
