"""Meshes that other apps made of an object: units, axes, colours, several objects in one file."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from ingest.scan.mesh_sources import read_scan_mesh
from ingest.scan.scan_sources import is_mesh
from omomo_core.errors import InputError


def _code(path: Path, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        read_scan_mesh(path, **options)  # pyright: ignore[reportArgumentType]
    assert str(path) in caught.value.where
    return caught.value.code


def _chair(scale: float = 1.0) -> trimesh.Trimesh:
    seat = trimesh.creation.box((0.4 * scale, 0.5 * scale, 0.9 * scale))
    seat.visual.vertex_colors = np.tile([200, 30, 40, 255], (8, 1)).astype(np.uint8)
    return seat


@pytest.mark.parametrize("kind", ["glb", "ply", "obj", "stl"])
def test_a_ready_mesh_in_metres_and_z_up(tmp_path: Path, kind: str):
    path = tmp_path / f"object.{kind}"
    solid = _chair()
    if kind == "glb":  # which is y up
        solid.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    solid.export(path)
    assert is_mesh(path)
    mesh = read_scan_mesh(path)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [0.4, 0.5, 0.9], atol=1e-6)
    assert mesh.notes == ()
    if kind in ("glb", "ply"):
        assert mesh.colours is not None
        # glTF's colours of vertices are linear: trimesh writes its bytes as they are.
        shown = [229, 96, 110] if kind == "glb" else [200, 30, 40]
        np.testing.assert_array_equal(mesh.colours[0], shown)


@pytest.mark.parametrize(
    ("scale", "unit", "other"),
    [(100, "centimetres", "inches"), (1000, "millimetres", ""), (1 / 0.0254, "inches", "cent")],
)
def test_units_are_guessed_and_told(tmp_path: Path, scale: float, unit: str, other: str):
    path = tmp_path / "object.ply"
    _chair(scale).export(path)
    mesh = read_scan_mesh(path)
    assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(0.9, rel=1e-6)
    (note,) = mesh.notes
    assert note.severity == "warn"
    assert unit in note.message
    assert other in note.message
    assert "‹unit›" in note.fix


def test_a_unit_or_a_height_that_somebody_knows(tmp_path: Path):
    path = tmp_path / "object.ply"
    _chair(100).export(path)
    inches = read_scan_mesh(path, unit="in")
    assert np.ptp(inches.vertices[:, 2]) == pytest.approx(90 * 0.0254)
    high = read_scan_mesh(path, height=0.84)
    assert np.ptp(high.vertices[:, 2]) == pytest.approx(0.84)
    assert high.notes == ()
    _chair(1e7).export(path)
    assert _code(path) == "mesh-units"
    assert _code(path, height=-1.0) == "mesh-units"


def _two(path: Path) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(_chair(), node_name="chair")
    far = trimesh.transformations.translation_matrix([2, 0, 0])
    scene.add_geometry(_chair(), node_name="box", transform=far)
    near = trimesh.transformations.translation_matrix([0, 0.2, 0.5])
    scene.add_geometry(_chair(0.5), node_name="cushion", transform=near)
    scene.export(path)


def test_two_objects_in_one_file_are_asked_about(tmp_path: Path):
    path = tmp_path / "objects.glb"
    _two(path)
    with pytest.raises(InputError) as caught:
        read_scan_mesh(path)
    assert caught.value.code == "mesh-objects"
    assert "2 objects" in caught.value.what
    assert "chair" in caught.value.what
    assert "box" in caught.value.what
    assert len(read_scan_mesh(path, name="chair").faces) == 12
    assert _code(path, name="table") == "mesh-object-unknown"


def test_pieces_of_one_object_are_joined(tmp_path: Path):
    path = tmp_path / "pieces.glb"
    scene = trimesh.Scene([_chair()])
    scene.add_geometry(
        _chair(0.5), transform=trimesh.transformations.translation_matrix([0, 0, 0.6])
    )
    scene.export(path)
    assert len(read_scan_mesh(path).faces) == 24


def test_usdz_with_its_unit_and_up_axis(tmp_path: Path):
    pytest.importorskip("pxr")
    path = write_usdz(tmp_path, {"chair": (0.0, 0.0, 0.0)}, metres=0.01)
    mesh = read_scan_mesh(path)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [0.4, 0.5, 0.9], atol=1e-6)
    assert mesh.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert mesh.notes == ()


def test_usdz_with_two_objects(tmp_path: Path):
    pytest.importorskip("pxr")
    path = write_usdz(tmp_path, {"chair": (0, 0, 0), "box": (300, 0, 0)}, metres=0.01)
    assert _code(path) == "mesh-objects"
    mesh = read_scan_mesh(path, name="box")
    assert mesh.vertices[:, 0].min() == pytest.approx(2.8)


def write_usdz(folder: Path, things: dict[str, tuple[float, float, float]], metres: float) -> Path:
    """Boxes of 0.4 x 0.5 x 0.9 m standing on the floor of a stage that is y up."""
    from pxr import Gf, Usd, UsdGeom, UsdUtils

    plain = folder / "stage.usdc"
    stage = Usd.Stage.CreateNew(str(plain))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, metres)
    for name, at in things.items():
        root = UsdGeom.Xform.Define(stage, f"/{name}")
        root.AddTranslateOp().Set(Gf.Vec3d(*at))
        mesh = UsdGeom.Mesh.Define(stage, f"/{name}/mesh")
        x, y, z = 0.2 / metres, 0.9 / metres, 0.25 / metres
        corners = [(a, b, c) for a in (-x, x) for b in (0, y) for c in (-z, z)]
        quads = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
        mesh.CreatePointsAttr([Gf.Vec3f(*corner) for corner in corners])
        mesh.CreateFaceVertexCountsAttr([4] * 6)
        mesh.CreateFaceVertexIndicesAttr(quads)
    stage.Save()
    path = folder / "object.usdz"
    UsdUtils.CreateNewUsdzPackage(str(plain), str(path))
    return path


def test_damaged_and_empty_meshes(tmp_path: Path):
    path = tmp_path / "object.glb"
    path.write_bytes(b"glTF" + bytes(20))
    assert _code(path) == "mesh-unreadable"
    cloud = tmp_path / "cloud.ply"
    trimesh.PointCloud(np.eye(3)).export(cloud)
    assert _code(cloud) in ("mesh-empty", "mesh-unreadable")
    wild = tmp_path / "wild.obj"
    wild.write_text("v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n")
    assert _code(wild) in ("mesh-not-finite", "mesh-unreadable")
    assert _code(tmp_path / "absent.ply") == "mesh-missing"
