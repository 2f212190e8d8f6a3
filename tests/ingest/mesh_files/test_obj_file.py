"""OBJ: every way of writing the same polygons is the same surface."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from ingest.mesh import load_mesh
from ingest.mesh_files.obj_file import read_obj
from ingest.scan.mesh_sources import read_scan_mesh
from omomo_core.errors import InputError

CUBE = [(x, y, z) for x in (0.0, 0.4) for y in (0.0, 0.3) for z in (0.0, 0.6)]
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def volume(path: Path) -> float:
    mesh = load_mesh(path)
    return float(trimesh.Trimesh(mesh.vertices, mesh.faces).volume)


@st.composite
def writings(draw: st.DrawFn) -> bytes:
    """Two cubes side by side in one of the ways in which programs write them."""
    blank = st.sampled_from([" ", "  ", "\t", " \t", " \\\n "])
    end = draw(st.sampled_from(["\n", "\r\n"]))
    relative, texture, normal = draw(st.booleans()), draw(st.booleans()), draw(st.booleans())
    lines = list[str]()

    def say(*words: object) -> None:
        gap = draw(blank).replace("\n", end)
        lead = draw(st.sampled_from(["", " ", "\t"]))
        tail = draw(st.sampled_from(["", " ", "  # f 1 2 3", "\t#"]))
        lines.append(lead + gap.join(map(str, words)) + tail)

    for part in range(2):
        say(draw(st.sampled_from(["o", "g", "#"])), f"part {part}")
        for x, y, z in CUBE:
            say("v", x + part, y, z)
            say("vt", x, y)
            say("vn", 0, 0, 1)
        for quad in QUADS:
            words = []
            for k in quad:
                at = k - 8 if relative else k + 1 + 8 * part
                uv = f"/{at}" if texture else "/" if normal else ""
                words.append(f"{at}{uv}" + (f"/{at}" if normal else ""))
            say(draw(st.sampled_from(["f", "f", "fo"])), *words)
        if draw(st.booleans()):
            say("s", "off")
            say("l", 1, 2)
    return (end.join(lines) + draw(st.sampled_from(["", end, end + end]))).encode()


@settings(
    max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
@given(text=writings())
def test_all_writings_are_one_surface(tmp_path: Path, text: bytes):
    path = tmp_path / "a.obj"
    path.write_bytes(text)
    mesh = load_mesh(path)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [1.4, 0.3, 0.6])
    assert len(mesh.faces) == 24
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(2 * 0.4 * 0.3 * 0.6)


@settings(
    max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
@given(
    radii=st.lists(st.floats(0.2, 1.0), min_size=3, max_size=14),
    turn=st.floats(0.0, 6.0),
    tilt=st.floats(-1.0, 1.0),
)
def test_polygons_of_any_shape_keep_their_area(
    tmp_path: Path, radii: list[float], turn: float, tilt: float
):
    """A star around a middle is a polygon that may be as concave as it likes."""
    angle = turn + np.arange(len(radii)) * 2 * np.pi / len(radii)
    x, y = np.array(radii) * [np.cos(angle), np.sin(angle)]
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) * np.hypot(1, tilt)
    lines = [f"v {a!r} {b!r} {tilt * a!r}" for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    path = tmp_path / "star.obj"
    path.write_text("\n".join([*lines, "f " + " ".join(str(k + 1) for k in range(len(x))), ""]))
    (part,) = read_obj(path, 100).parts
    surface = trimesh.Trimesh(part.vertices, part.faces, process=False)
    assert len(part.faces) == len(radii) - 2
    assert surface.area == pytest.approx(abs(area), rel=1e-6)


def test_a_concave_quad_is_cut_along_its_inner_diagonal(tmp_path: Path):
    path = tmp_path / "arrow.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv .2 .2 0\nv 0 1 0\nf 2 3 4 1\n")
    mesh = load_mesh(path)
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).area == pytest.approx(0.2)


@pytest.mark.parametrize("scale", [1, 255])
def test_colours_stand_behind_places(tmp_path: Path, scale: int):
    path = tmp_path / "c.obj"
    rows = [f"v {x} {y} {z} {0.5 * scale} 0 {1 * scale}" for x, y, z in CUBE]
    faces = ["f " + " ".join(str(k + 1) for k in quad) for quad in QUADS]
    path.write_text("\n".join([*rows, *faces, ""]))
    mesh = read_scan_mesh(path)
    assert mesh.colours is not None
    np.testing.assert_array_equal(mesh.colours[0], [128, 0, 255])


def test_names_with_blanks_and_options_of_pictures(tmp_path: Path):
    Image.new("RGB", (2, 2), (10, 20, 30)).save(tmp_path / "my wood.png")
    (tmp_path / "my chair.mtl").write_text(
        "newmtl old wood\nKd 1 1 1\n\tmap_Kd -s 2 2 1 -o 0.5 0 My Wood.png\nnewmtl plain\nKd 1 0 0\n"
    )
    path = tmp_path / "chair.obj"
    rows = [f"v {x} {y} {z}" for x, y, z in CUBE]
    faces = [f"f {a + 1}/1 {b + 1}/1 {c + 1}/1 {d + 1}/1" for a, b, c, d in QUADS]
    head = ["mtllib my chair.mtl", *rows, "vt 0.1 0.2", "usemtl old wood", *faces[:3]]
    path.write_text("\n".join([*head, "usemtl plain", *faces[3:], ""]))
    mesh = load_mesh(path)
    assert mesh.texture is not None
    assert {tuple(c) for c in mesh.texture.image.reshape(-1, 3).tolist()} == {
        (10, 20, 30),
        (255, 0, 0),
    }
    assert "2 parts" in mesh.notes
    assert volume(path) == pytest.approx(0.072)


def test_a_library_elsewhere_is_not_read(tmp_path: Path):
    (tmp_path / "in").mkdir()
    Image.new("RGB", (2, 2)).save(tmp_path / "secret.png")
    (tmp_path / "in" / "a.mtl").write_text("newmtl m\nmap_Kd ../secret.png\n")
    path = tmp_path / "in" / "a.obj"
    path.write_text("mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
    mesh = load_mesh(path)
    assert mesh.texture is None
    assert any("secret.png" in note for note in mesh.notes)


@pytest.mark.parametrize(
    ("end", "code"),
    [
        ("f 1 2 4 3", None),  # whole: no vertex has a longer number
        ("f 1 2 4\\\n 3", None),
        ("f 1 2", "mesh-truncated"),
        ("f 1 2 4 9\n", "mesh-unreadable"),
        ("f 1 2 4 -9\n", "mesh-unreadable"),
        ("f 1 2 0 3\n", "mesh-unreadable"),
        ("f 1 2 x 3\n", "mesh-unreadable"),
    ],
)
def test_ends(tmp_path: Path, end: str, code: str | None):
    path = tmp_path / "a.obj"
    rows = [f"v {x} {y} {z}" for x, y, z in CUBE]
    faces = ["f " + " ".join(str(k + 1) for k in quad) for quad in QUADS[1:4]]
    path.write_text("\n".join([*rows, *faces, end]))
    if code is None:
        assert len(load_mesh(path).faces) == 8
    else:
        with pytest.raises(InputError) as caught:
            load_mesh(path)
        assert caught.value.code == code


def test_a_number_that_lacks_digits_is_found(tmp_path: Path):
    """The last face would meet its neighbours with one digit more."""
    ball = trimesh.creation.icosphere(2, 0.3)
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in ball.vertices.tolist()]
    faces = sorted((ball.faces + 1).tolist(), key=lambda face: face[2] >= 100)
    path = tmp_path / "ball.obj"
    path.write_text("\n".join([*rows, *("f {} {} {}".format(*face) for face in faces)])[:-1])
    with pytest.raises(InputError, match="lacks digits"):
        load_mesh(path)


def test_a_decimal_comma_and_lacking_materials_are_named(tmp_path: Path):
    path = tmp_path / "a.obj"
    rows = [f"v {x} {y} {z}" for x, y, z in CUBE]
    faces = ["f " + " ".join(str(k + 1) for k in quad) for quad in QUADS]
    path.write_text("\n".join([*rows, *faces, ""]).replace(".", ","))
    with pytest.raises(InputError, match="'0,0 0,0 0,0' are no numbers of a vertex"):
        load_mesh(path)
    textured = ["f " + " ".join(f"{k + 1}/1" for k in quad) for quad in QUADS]
    path.write_text("\n".join(["mtllib my chair.mtl", *rows, "vt 0 0", *textured, ""]))
    assert "its materials left out: my chair.mtl is not beside it" in load_mesh(path).notes
