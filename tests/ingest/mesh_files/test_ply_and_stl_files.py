"""PLY and STL: what other programs write, and what plyfile writes, is read as it says."""

import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from ingest.mesh import load_mesh
from ingest.scan.mesh_sources import read_scan_mesh
from omomo_core.errors import InputError
from tests.ingest.mesh_files.test_obj_file import CUBE, QUADS

plyfile = pytest.importorskip("plyfile")

POLYGONS = [QUADS[0], QUADS[1], QUADS[2], (2, 3, 7), (2, 7, 6), QUADS[4], QUADS[5]]


def vertices(**more: tuple[str, object]) -> np.ndarray:
    rows = np.zeros(
        8, [("x", "f4"), ("y", "f8"), ("z", "f4"), *((n, t) for n, (t, _) in more.items())]
    )
    rows["x"], rows["y"], rows["z"] = np.array(CUBE).T
    for name, (_, value) in more.items():
        rows[name] = value
    return rows


def is_the_cube(path: Path, triangles: int = 12) -> None:
    mesh = load_mesh(path)
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces)
    assert len(mesh.faces) == triangles
    assert solid.is_watertight
    assert solid.volume == pytest.approx(0.4 * 0.3 * 0.6, rel=1e-6)


@settings(
    max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
@given(
    layout=st.sampled_from(["ascii", "<", ">"]),
    name=st.sampled_from(["vertex_index", "vertex_indices"]),
    counted=st.sampled_from(["u1", "i1", "u2", "i4", "u4"]),
    kind=st.sampled_from(["u1", "i1", "u2", "i4", "u4"]),
    flags=st.booleans(),
    extra=st.booleans(),
)
def test_what_plyfile_writes(
    tmp_path: Path, layout: str, name: str, counted: str, kind: str, flags: bool, extra: bool
):
    faces = np.zeros(
        len(POLYGONS), [("flags", "u2"), (name, "O"), ("weight", "f8")] if flags else [(name, "O")]
    )
    for k, polygon in enumerate(POLYGONS):
        faces[name][k] = np.array(polygon, kind)
    parts = [
        plyfile.PlyElement.describe(vertices(quality=("f4", 0.5)), "vertex"),
        plyfile.PlyElement.describe(
            faces, "face", len_types={name: counted}, val_types={name: kind}
        ),
    ]
    if extra:
        bones = np.zeros(3, [("links", "O")])
        for k in range(3):
            bones["links"][k] = np.arange(k, dtype="f4")
        parts.insert(1, plyfile.PlyElement.describe(bones, "bone", val_types={"links": "f4"}))
    order = {"text": True} if layout == "ascii" else {"byte_order": layout}
    path = tmp_path / "a.ply"
    plyfile.PlyData(parts, comments=["a comment"], **order).write(str(path))
    is_the_cube(path)


@pytest.mark.parametrize("text", [True, False])
def test_strips(tmp_path: Path, text: bool):
    strips = np.zeros(1, [("vertex_indices", "O")])
    strips["vertex_indices"][0] = np.array(
        [k for a, b, c, d in QUADS for k in (a, b, d, c, -1)], "i4"
    )
    parts = [
        plyfile.PlyElement.describe(vertices(), "vertex"),
        plyfile.PlyElement.describe(strips, "tristrips", len_types={"vertex_indices": "i4"}),
    ]
    path = tmp_path / "a.ply"
    plyfile.PlyData(parts, text=text).write(str(path))
    is_the_cube(path)
    assert "triangle strips unrolled" in load_mesh(path).notes


@pytest.mark.parametrize(("kind", "half"), [("u1", 128), ("f4", 128 / 255), ("u2", 128 * 257)])
@pytest.mark.parametrize("text", [True, False])
def test_colours(tmp_path: Path, kind: str, half: float, text: bool):
    faces = np.zeros(len(POLYGONS), [("vertex_indices", "O")])
    for k, polygon in enumerate(POLYGONS):
        faces["vertex_indices"][k] = np.array(polygon, "i4")
    rows = vertices(red=(kind, half), green=(kind, 0), blue=(kind, half))
    parts = [
        plyfile.PlyElement.describe(rows, "vertex"),
        plyfile.PlyElement.describe(faces, "face"),
    ]
    path = tmp_path / "a.ply"
    plyfile.PlyData(parts, text=text).write(str(path))
    mesh = read_scan_mesh(path)
    assert mesh.colours is not None
    np.testing.assert_array_equal(np.unique(mesh.colours, axis=0), [[128, 0, 128]])


def test_places_on_a_picture_at_the_corners_of_faces(tmp_path: Path):
    Image.new("RGB", (4, 4), (9, 8, 7)).save(tmp_path / "skin of it.png")
    faces = np.zeros(len(POLYGONS), [("vertex_indices", "O"), ("texcoord", "O")])
    for k, polygon in enumerate(POLYGONS):
        faces["vertex_indices"][k] = np.array(polygon, "i4")
        faces["texcoord"][k] = np.tile(np.array([0.25, 0.75], "f4"), len(polygon))
    parts = [
        plyfile.PlyElement.describe(vertices(), "vertex"),
        plyfile.PlyElement.describe(faces, "face", val_types={"texcoord": "f4"}),
    ]
    path = tmp_path / "a.ply"
    plyfile.PlyData(parts, comments=["TextureFile skin of it.png"]).write(str(path))
    mesh = load_mesh(path)
    assert mesh.texture is not None
    np.testing.assert_allclose(mesh.texture.uv, np.broadcast_to([0.25, 0.25], (12, 3, 2)))
    np.testing.assert_array_equal(mesh.texture.image[0, 0], [9, 8, 7])


def _two_pictures(path: Path, *, numbered: bool, second: str = "b.png") -> Path:
    """A cube whose first face shows b.png, and the others a.png."""
    Image.new("RGB", (4, 4), (9, 8, 7)).save(path.parent / "a.png")
    Image.new("RGB", (4, 4), (200, 100, 50)).save(path.parent / "b.png")
    extra = [("texnumber", "i4")] if numbered else []
    faces = np.zeros(len(POLYGONS), [("vertex_indices", "O"), ("texcoord", "O"), *extra])
    for k, polygon in enumerate(POLYGONS):
        faces["vertex_indices"][k] = np.array(polygon, "i4")
        faces["texcoord"][k] = np.full(2 * len(polygon), 0.5, "f4")
    if numbered:
        faces["texnumber"][0] = 1
    parts = [
        plyfile.PlyElement.describe(vertices(), "vertex"),
        plyfile.PlyElement.describe(faces, "face"),
    ]
    comments = ["TextureFile a.png", f"TextureFile {second}"]
    plyfile.PlyData(parts, comments=comments).write(str(path))
    return path


def test_each_face_shows_its_own_picture_of_several(tmp_path: Path):
    """MeshLab numbers the pictures of faces by texnumber."""
    path = _two_pictures(tmp_path / "a.ply", numbered=True)
    is_the_cube(path)
    mesh = load_mesh(path)
    assert mesh.texture is not None
    corners = {tuple(np.round(p, 4)) for p in np.array(CUBE)[list(QUADS[0])]}
    of_first = np.array(
        [{tuple(np.round(p, 4)) for p in mesh.vertices[face]} <= corners for face in mesh.faces]
    )
    image, uv = mesh.texture.image, mesh.texture.uv.mean(axis=1)
    at = (uv * [image.shape[1], image.shape[0]]).astype(int)
    seen = image[at[:, 1], at[:, 0]]
    assert of_first.sum() == 2
    np.testing.assert_array_equal(seen[of_first], [[200, 100, 50]] * 2)
    np.testing.assert_array_equal(seen[~of_first], [[9, 8, 7]] * 10)


def test_pictures_that_are_left_out_are_told(tmp_path: Path):
    mesh = load_mesh(_two_pictures(tmp_path / "a.ply", numbered=False))
    assert mesh.texture is None
    assert "its pictures left out: its faces do not say which one they show" in mesh.notes
    mesh = load_mesh(_two_pictures(tmp_path / "b.ply", numbered=True, second="gone.png"))
    assert mesh.texture is not None
    assert "its picture gone.png left out: it is not beside it, or damaged" in mesh.notes


@pytest.mark.parametrize("text", [True, False])
@pytest.mark.parametrize("cut", [1, 30, 120])
def test_a_file_without_its_end_is_cut_short(tmp_path: Path, text: bool, cut: int):
    path = tmp_path / "a.ply"
    trimesh.creation.box((0.4, 0.3, 0.6)).export(path, encoding="ascii" if text else "binary")
    whole = path.read_bytes().rstrip(b"\n") if text else path.read_bytes()
    path.write_bytes(whole[:-cut])
    if text and cut == 1:  # the last number has lost a digit, or its row one
        return
    with pytest.raises(InputError) as caught:
        load_mesh(path)
    assert caught.value.code == "mesh-truncated"


@pytest.mark.parametrize("rows", [10**6, 10**15])
def test_more_rows_than_bytes_are_refused_at_once(tmp_path: Path, rows: int):
    path = tmp_path / "a.ply"
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {rows}\n"
    path.write_bytes(
        (head + "property float x\nproperty float y\nproperty float z\nend_header\n").encode()
    )
    with pytest.raises(InputError) as caught:
        load_mesh(path)
    assert caught.value.code == "mesh-truncated"


def test_faces_of_an_unknown_name_are_named(tmp_path: Path):
    path = tmp_path / "a.ply"
    trimesh.creation.box((0.4, 0.3, 0.6)).export(path, encoding="ascii")
    path.write_text(path.read_text().replace("vertex_indices", "vertex_ids"))
    with pytest.raises(InputError, match="faces have no list vertex_indices, but vertex_ids"):
        load_mesh(path)


def test_binary_stl_may_begin_like_text(tmp_path: Path):
    box = trimesh.creation.box((0.4, 0.3, 0.6))
    data = bytearray(trimesh.exchange.stl.export_stl(box))
    data[:30] = b"solid made by some program    "
    path = tmp_path / "a.stl"
    path.write_bytes(data)
    is_the_cube_of_stl(path)
    path.write_bytes(data + b"\0\0some program's own data")
    is_the_cube_of_stl(path)
    path.write_bytes(data[:-60])
    with pytest.raises(InputError, match="10 triangles follow its header instead of 12"):
        load_mesh(path)


def is_the_cube_of_stl(path: Path) -> None:
    mesh = load_mesh(path)
    assert len(mesh.faces) == 12
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).volume == pytest.approx(0.072, rel=1e-6)


def test_text_stl_of_two_solids(tmp_path: Path):
    box = trimesh.creation.box((0.4, 0.3, 0.6))
    text = trimesh.exchange.stl.export_stl_ascii(box)
    box.apply_translation([1, 0, 0])
    path = tmp_path / "a.stl"
    both = (text + "\n" + trimesh.exchange.stl.export_stl_ascii(box)).replace("vertex", "VERTEX\t")
    path.write_text(both.replace("\n", "\r\n"))
    assert len(load_mesh(path).faces) == 24
    path.write_text(both[:-300])
    with pytest.raises(InputError) as caught:
        load_mesh(path)
    assert caught.value.code == "mesh-truncated"


def test_an_stl_says_how_many_triangles_it_has(tmp_path: Path):
    path = tmp_path / "a.stl"
    path.write_bytes(bytes(80) + struct.pack("<I", 3) + bytes(160))
    with pytest.raises(InputError) as caught:
        load_mesh(path)
    assert caught.value.code == "mesh-empty"


def test_a_decimal_comma_in_stl_is_named(tmp_path: Path):
    text = trimesh.exchange.stl.export_stl_ascii(trimesh.creation.box((0.5, 0.4, 0.3)))
    path = tmp_path / "a.stl"
    path.write_text(text.replace(".", ","))
    with pytest.raises(InputError, match="is no number of a vertex"):
        load_mesh(path)
