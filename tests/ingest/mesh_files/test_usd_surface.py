"""What a USD stage draws: nothing hidden, every copy, native shapes; as USD itself bounds it."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from ingest.scan.mesh_sources import read_scan_mesh
from omomo_core.errors import InputError

pytest.importorskip("pxr")

BOX = """def Mesh "{name}" {{
  float3[] extent = [(-.2, -.3, -.1), (.2, .3, .1)]
  int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
  int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
  point3f[] points = [(-.2, -.3, -.1), (-.2, -.3, .1), (-.2, .3, -.1), (-.2, .3, .1),
    (.2, -.3, -.1), (.2, -.3, .1), (.2, .3, -.1), (.2, .3, .1)]
  {more}
}}
"""


def stage(path: Path, body: str, head: str = "") -> Path:
    path.write_text(f'#usda 1.0\n(\n  metersPerUnit = 1\n  upAxis = "Z"\n{head}\n)\n{body}')
    return path


def box(name: str = "box", more: str = "") -> str:
    return BOX.format(name=name, more=more)


def wrapped(inside: str, *said: str, kind: str = "Xform") -> str:
    return (
        f'def {kind} "w{abs(hash((inside, said))) % 10**6}" {{\n'
        + "\n".join(said)
        + "\n"
        + inside
        + "}\n"
    )


FAR = (
    'double3 xformOp:translate = (9, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'
)


@pytest.mark.parametrize(
    "hidden",
    [
        box("x", FAR + 'token visibility = "invisible"'),
        wrapped(wrapped(box("x"), FAR), 'token visibility = "invisible"'),
        box("x", FAR + 'uniform token purpose = "guide"'),
        wrapped(box("x", FAR), 'uniform token purpose = "proxy"'),
        wrapped(wrapped(box("x", FAR)), 'uniform token purpose = "guide"', kind="Scope"),
        box("x", FAR).replace("def Mesh", "class Mesh"),
        box("x", FAR).replace("def Mesh", "over"),
        box("x", FAR).replace('"x" {', '"x" (active = false) {'),
    ],
)
def test_what_is_not_drawn_is_left_out(tmp_path: Path, hidden: str):
    drawn = wrapped(box(), 'uniform token purpose = "render"')
    mesh = read_scan_mesh(stage(tmp_path / "a.usda", drawn + hidden))
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [0.4, 0.6, 0.2], atol=1e-6)
    assert len(mesh.faces) == 12


def test_a_stage_of_hidden_things_says_so(tmp_path: Path):
    path = stage(tmp_path / "a.usda", box(more='uniform token purpose = "guide"'))
    with pytest.raises(InputError, match="1 guide") as caught:
        read_scan_mesh(path)
    assert caught.value.code == "mesh-empty"


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
@pytest.mark.parametrize(
    ("shape", "sizes", "volume"),
    [
        ("Cube", "double size = 0.4", 0.064),
        ("Sphere", "double radius = 0.3", 4 / 3 * np.pi * 0.027),
        ("Cylinder", "double radius = 0.1\ndouble height = 0.8", np.pi * 0.008),
        ("Cone", "double radius = 0.1\ndouble height = 0.8", np.pi * 0.008 / 3),
        ("Capsule", "double radius = 0.1\ndouble height = 0.8", np.pi * (0.008 + 4 / 3 * 0.001)),
    ],
)
def test_native_shapes_are_bounded_as_usd_says(
    tmp_path: Path, shape: str, sizes: str, volume: float, axis: str
):
    from pxr import Usd, UsdGeom

    turned = "" if shape in ("Cube", "Sphere") else f'\nuniform token axis = "{axis}"'
    path = stage(tmp_path / "a.usda", f'def {shape} "s" {{\n{sizes}{turned}\n}}\n')
    mesh = read_scan_mesh(path)
    opened = Usd.Stage.Open(str(path))
    prim = UsdGeom.Boundable(opened.GetPrimAtPath("/s"))
    extent = UsdGeom.Boundable.ComputeExtentFromPlugins(prim, Usd.TimeCode.Default())
    bounds = np.stack([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])
    np.testing.assert_allclose(bounds, np.array(extent), atol=1e-3)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(volume, rel=0.02)


def test_a_cone_points_along_its_axis(tmp_path: Path):
    path = stage(
        tmp_path / "a.usda",
        'def Cone "s" {\ndouble radius = 0.2\ndouble height = 0.6\nuniform token axis = "X"\n}',
    )
    mesh = read_scan_mesh(path)
    tip = mesh.vertices[np.abs(mesh.vertices[:, 1:]).max(axis=1) < 1e-9]
    assert tip[:, 0].max() == pytest.approx(0.3)


def instancer(prototype: str, at: str, more: str = "", name: str = "many") -> str:
    return f'''def PointInstancer "{name}" {{
  rel prototypes = <{prototype}>
  point3f[] positions = {at}
  int[] protoIndices = {"[" + ", ".join("0" * at.count("(")) + "]"}
  {more}
'''


def test_instances_prototypes_and_masks(tmp_path: Path):
    """The prototype stands below its instancer, where it is not drawn by itself; one copy is masked."""
    body = instancer("/many/box", "[(-1, 0, 0), (1, 0, 0), (0, 9, 0)]", "int64[] inactiveIds = [2]")
    body = body.replace('many" {', 'many" (\n  inactiveIds = [2]\n) {').replace(
        "int64[] inactiveIds = [2]", ""
    )
    path = stage(tmp_path / "a.usda", body + box(more=FAR) + "}\n")
    mesh = read_scan_mesh(path, height=0.2)
    assert len(mesh.faces) == 24
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [2.4, 0.6, 0.2], atol=1e-6)
    assert mesh.vertices[:, 0].mean() == pytest.approx(9)
    assert any("24 triangles from 2 instances" in note.message for note in mesh.notes)


def test_instancers_in_instancers(tmp_path: Path):
    inner = instancer("/many/inner/box", "[(0, -1, 0), (0, 1, 0)]", name="inner") + box() + "}\n"
    body = instancer("/many/inner", "[(-1, 0, 0), (1, 0, 0)]") + inner + "}\n"
    mesh = read_scan_mesh(stage(tmp_path / "a.usda", body), height=0.2)
    assert len(mesh.faces) == 48
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [2.4, 2.6, 0.2], atol=1e-6)


def test_native_instances_and_a_mirror(tmp_path: Path):
    prototype = wrapped(box()).replace("def Xform", "class Xform").replace('"w', '"p', 1)
    name = prototype.split('"')[1]
    mirror = 'double3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    copies = f'def "a" (\n instanceable = true\n references = </{name}>\n) {{\n {mirror}\n}}\n'
    mesh = read_scan_mesh(stage(tmp_path / "a.usda", prototype + copies))
    assert len(mesh.faces) == 12
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).volume == pytest.approx(0.048)


def test_holes_are_open_and_colours_are_linear(tmp_path: Path):
    more = "int[] holeIndices = [0]\ncolor3f[] primvars:displayColor = [(0.2159, 0, 1)]"
    mesh = read_scan_mesh(stage(tmp_path / "a.usda", box(more=more)))
    assert len(mesh.faces) == 10
    assert mesh.colours is not None
    np.testing.assert_array_equal(mesh.colours[0], [128, 0, 255])


def test_what_is_no_surface_is_named(tmp_path: Path):
    curve = 'def BasisCurves "c" {\nint[] curveVertexCounts = [2]\npoint3f[] points = [(0,0,0),(9,0,0)]\n}\n'
    mesh = read_scan_mesh(stage(tmp_path / "a.usda", box() + curve))
    assert len(mesh.faces) == 12
    assert any("BasisCurves" in note.message for note in mesh.notes)
