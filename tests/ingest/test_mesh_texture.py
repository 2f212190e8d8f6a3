"""A mesh file's texture is read with its surface, and shapes it in nothing."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from ingest.mesh import load_mesh
from omomo_core.motion import ObjectMesh
from tests.textured_box import COLOURS, write_textured_box


def sides(mesh: ObjectMesh) -> np.ndarray:
    """Of each triangle the side of the box that it lies on, counted as COLOURS are."""
    corners = mesh.vertices[mesh.faces]
    axis = np.ptp(corners, axis=1).argmin(axis=1)
    return 2 * axis + (corners.mean(axis=1)[np.arange(len(axis)), axis] > 0)


def shown(mesh: ObjectMesh) -> np.ndarray:
    """The colour at each corner of each triangle."""
    assert mesh.texture is not None
    height, width = mesh.texture.image.shape[:2]
    x, y = (mesh.texture.uv % 1.0 * [width, height]).astype(int).reshape(-1, 2).T
    return mesh.texture.image[y, x].reshape(-1, 3, 3)


@pytest.mark.parametrize("kind", ["obj", "glb"])
def test_every_corner_has_the_colour_of_its_side(tmp_path: Path, kind: str) -> None:
    mesh = load_mesh(write_textured_box(tmp_path / f"box.{kind}"))
    assert (len(mesh.vertices), len(mesh.faces)) == (8, 12)
    side = sides(mesh)
    if kind == "glb":  # y up in the file: our -y is its +z, our +z its +y
        side = np.array([0, 1, 5, 4, 2, 3])[side]
    wanted = COLOURS[side][:, None]
    there = shown(mesh)
    dark = (there == wanted // 2).all(axis=2)
    assert ((there == wanted).all(axis=2) | dark).all()
    assert dark.any()
    assert not dark.all()


def test_the_surface_is_that_of_the_same_file_without_a_picture(tmp_path: Path) -> None:
    painted = load_mesh(write_textured_box(tmp_path / "box.obj"))
    for picture in tmp_path.glob("*.png"):
        picture.unlink()
    plain = load_mesh(tmp_path / "box.obj")
    assert plain.texture is None
    np.testing.assert_array_equal(painted.vertices, plain.vertices)
    np.testing.assert_array_equal(painted.faces, plain.faces)


def test_a_damaged_picture_is_no_picture(tmp_path: Path) -> None:
    path = write_textured_box(tmp_path / "box.obj")
    for picture in tmp_path.glob("*.png"):
        picture.write_bytes(picture.read_bytes()[:40])
    assert load_mesh(path).texture is None


def test_pictures_of_several_parts_become_one(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for k in range(2):
        part = trimesh.load_mesh(write_textured_box(tmp_path / f"{k}.glb"), process=False)
        part.visual.material.baseColorFactor = [255, 255, 255 - 255 * k, 255]
        part.apply_translation([k, 0, 0])
        scene.add_geometry(part, node_name=f"part {k}")
    scene.export(tmp_path / "both.glb")
    mesh = load_mesh(tmp_path / "both.glb")
    colours = shown(mesh).reshape(-1, 3)
    assert mesh.texture is not None
    assert len(mesh.texture.uv) == 24
    there = {tuple(colour) for colour in colours.tolist()}
    assert {tuple(colour) for colour in COLOURS.tolist()} <= there
    assert {(red, green, 0) for red, green, _ in COLOURS.tolist()} <= there
