"""load_mesh: five formats, one convention, bounded and in metres."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

import ingest.mesh as mesh_module
from ingest.mesh import load_mesh
from omomo_core.errors import InputError


def _chair_like() -> trimesh.Trimesh:
    """0.4 wide (x), 0.5 deep (y), 0.9 tall (z), standing on z = 0."""
    box = trimesh.creation.box((0.4, 0.5, 0.9))
    box.apply_translation((0, 0, 0.45))
    return box


def _error(path: Path, **options: float) -> InputError:
    with pytest.raises(InputError) as caught:
        load_mesh(path, **options)
    return caught.value


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl"])
def test_formats_without_an_up_axis_stay_as_they_are(tmp_path: Path, suffix: str):
    path = tmp_path / f"chair.{suffix}"
    _chair_like().export(path)
    mesh = load_mesh(path)
    assert mesh.name == "chair"
    assert mesh.vertices.shape == (8, 3)
    assert mesh.faces.shape == (12, 3)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [0.4, 0.5, 0.9], atol=1e-6)
    assert mesh.vertices[:, 2].min() == pytest.approx(0)


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_gltf_is_turned_z_up(tmp_path: Path, suffix: str):
    path = tmp_path / f"chair.{suffix}"
    y_up = _chair_like()
    y_up.vertices = y_up.vertices @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    assert np.ptp(y_up.vertices, axis=0)[1] == pytest.approx(0.9)
    exported = y_up.export(file_type=suffix)
    if suffix == "glb":
        path.write_bytes(exported)
    else:
        for name, data in exported.items():
            (tmp_path / name.replace("model.gltf", path.name)).write_bytes(data)
    mesh = load_mesh(path)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [0.4, 0.5, 0.9], atol=1e-6)
    assert mesh.vertices[:, 2].min() == pytest.approx(0, abs=1e-6)
    turned = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert turned.volume == pytest.approx(0.4 * 0.5 * 0.9, rel=1e-5)


def test_scenes_are_joined_with_their_transforms(tmp_path: Path):
    scene = trimesh.Scene()
    leg = trimesh.creation.box((0.1, 0.1, 0.1))
    scene.add_geometry(leg)
    scene.add_geometry(leg, transform=trimesh.transformations.translation_matrix((1, 0, 0)))
    scene.export(tmp_path / "two.glb")
    mesh = load_mesh(tmp_path / "two.glb")
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [1.1, 0.1, 0.1], atol=1e-6)
    assert len(mesh.faces) == 24


def test_wrong_units_say_the_size_and_the_factor(tmp_path: Path):
    centimetres = _chair_like()
    centimetres.apply_scale(100)
    centimetres.export(tmp_path / "chair.obj")
    error = _error(tmp_path / "chair.obj")
    assert error.code == "mesh-units"
    assert "40 x 50 x 90 m" in error.what
    assert "‹mesh_scale› 0.01" in error.fix
    scaled = load_mesh(tmp_path / "chair.obj", scale=0.01)
    np.testing.assert_allclose(np.ptp(scaled.vertices, axis=0), [0.4, 0.5, 0.9], atol=1e-6)
    assert _error(tmp_path / "chair.obj", scale=0.0001).code == "mesh-units"
    for scale in (0.0, -1.0, float("nan")):
        assert _error(tmp_path / "chair.obj", scale=scale).code == "mesh-scale"


def test_empty_point_cloud_and_garbage(tmp_path: Path):
    trimesh.PointCloud(np.random.default_rng(0).random((20, 3))).export(tmp_path / "cloud.ply")
    assert _error(tmp_path / "cloud.ply").code == "mesh-empty"
    for suffix in ("obj", "ply", "stl", "glb", "gltf"):
        path = tmp_path / f"garbage.{suffix}"
        path.write_bytes(b"\x00\xffnot a mesh" * 20)
        assert _error(path).code in ("mesh-unreadable", "mesh-empty")
    (tmp_path / "hole.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n")
    assert _error(tmp_path / "hole.obj").code == "mesh-unreadable"
    assert _error(tmp_path / "none.obj").code == "mesh-missing"
    (tmp_path / "chair.blend").write_bytes(b"BLENDER")
    assert _error(tmp_path / "chair.blend").code == "mesh-format"


def test_triangles_without_any_area(tmp_path: Path):
    path = tmp_path / "lines.obj"
    path.write_text("v 0 0 0\nv .3 0 0\nv .6 0 0\nv 0 .2 0\nv 0 .6 0\nf 1 2 3\nf 1 4 5\n")
    assert _error(path).code == "mesh-empty"


def test_vertices_that_are_not_finite(tmp_path: Path):
    path = tmp_path / "nan.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n")
    assert _error(path).code == "mesh-not-finite"


def test_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "chair.obj"
    _chair_like().export(path)
    monkeypatch.setattr(mesh_module, "MAX_FACES", 5)
    assert "12 triangles" in _error(path).what
    monkeypatch.setattr(mesh_module, "MAX_BYTES", 10)
    assert _error(path).code == "mesh-too-large"


def test_real_furniture(shared: Path):
    assets = shared / "data/objects/kaykit_furniture_cc0/addons/kaykit_furniture_bits/Assets"
    chair = load_mesh(assets / "gltf" / "chair_A.gltf", scale=0.7)
    extents = np.ptp(chair.vertices, axis=0)
    assert extents[2] > 1.2 * extents[:2].max()
    assert chair.vertices[:, 2].min() == pytest.approx(0, abs=0.02)


@pytest.mark.parametrize("share", [0.75, 0.9, 0.99])
@pytest.mark.parametrize(("suffix", "options"), [("obj", {}), ("ply", {"encoding": "ascii"})])
def test_text_that_is_cut_short_is_no_smaller_mesh(
    tmp_path: Path, suffix: str, options: dict[str, str], share: float
):
    path = tmp_path / f"chair.{suffix}"
    _chair_like().subdivide().subdivide().export(path, **options)
    whole = path.read_bytes()
    assert len(load_mesh(path).faces) == 192
    kept = whole[: int(len(whole) * share)]
    path.write_bytes(kept)
    if suffix == "obj" and kept.endswith(b"f 93 71 7"):  # a whole line, and all vertices have faces
        assert "cut short" in load_mesh(path).notes[0]
    else:
        assert _error(path).code in ("mesh-truncated", "mesh-unreadable")


def test_a_closed_mesh_may_lack_the_last_line_end(tmp_path: Path):
    path = tmp_path / "chair.obj"
    _chair_like().export(path)
    path.write_bytes(path.read_bytes().rstrip())
    assert len(load_mesh(path).faces) == 12
