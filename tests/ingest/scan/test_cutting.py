"""An object is cut out of the mesh of a room: what stands at a point, with the app's own picture."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from ingest.mesh import load_mesh
from ingest.scan.clean_mesh import CleanMesh, save_mesh
from ingest.scan.cut_surface import cut_out
from ingest.scan.region import GivenBox
from ingest.scan.room_parts import has_floor, read_room
from omomo_core.errors import InputError
from tests.textured_room import (
    AT,
    CELL,
    THING,
    colour_at,
    room,
    write_room,
    write_room_usdz,
)

OTHER = (-1.2, 0.9)


def cut(path: Path, **said: object) -> CleanMesh:
    return cut_out(read_room(path), "thing", **said)  # pyright: ignore[reportArgumentType]


def refused(path: Path, **said: object) -> InputError:
    with pytest.raises(InputError) as caught:
        cut(path, **said)
    assert caught.value.fix
    return caught.value


@pytest.mark.parametrize("kind", ["glb", "obj"])
def test_the_one_thing_on_the_floor_is_cut_off_it_with_its_picture(tmp_path: Path, kind: str):
    made = cut(write_room(tmp_path / f"room.{kind}", room()))
    sides = np.ptp(made.mesh.vertices, axis=0)
    # The sheet's walls lean outwards by one cell.
    np.testing.assert_allclose(sides[:2], np.array(THING[:2]), atol=2.1 * CELL)
    assert sides[2] == pytest.approx(THING[2], abs=0.01)
    assert made.mesh.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    world = made.mesh.vertices @ made.T_world_object[:3, :3].T + made.T_world_object[:3, 3]
    np.testing.assert_allclose(world[:, :2].mean(axis=0), AT, atol=CELL)
    assert made.mesh.texture is not None
    assert made.mesh.colours is not None
    top = made.mesh.vertices[:, 2] > 0.5
    shown = made.mesh.colours[top, :2].astype(float)
    assert np.abs(shown - colour_at(world[top])).max() < 4


def test_a_usdz_of_a_room_gives_its_picture_too(tmp_path: Path):
    pytest.importorskip("pxr")
    made = cut(write_room_usdz(tmp_path, room()))
    assert np.ptp(made.mesh.vertices[:, 2]) == pytest.approx(THING[2], abs=0.01)
    assert made.mesh.texture is not None
    assert made.mesh.colours is not None
    world = made.mesh.vertices @ made.T_world_object[:3, :3].T + made.T_world_object[:3, 3]
    top = made.mesh.vertices[:, 2] > 0.5
    assert np.abs(made.mesh.colours[top, :2].astype(float) - colour_at(world[top])).max() < 4


def test_what_is_made_up_goes_straight_down_and_is_marked(tmp_path: Path):
    made = cut(write_room(tmp_path / "room.glb", room()))
    low = made.mesh.vertices[:, 2] < 0.01
    assert low.any()
    np.testing.assert_array_equal(made.seen, ~low)
    surface = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    assert surface.is_winding_consistent
    assert [note.severity for note in made.mesh.notes if note.name != "up"] == ["ok"] * 4


def test_what_is_saved_is_read_as_the_same_with_its_texture(tmp_path: Path):
    made = cut(write_room(tmp_path / "room.glb", room()))
    save_mesh(made, tmp_path / "thing.glb")
    mesh = load_mesh(tmp_path / "thing.glb")
    assert mesh.texture is not None
    assert len(mesh.faces) == len(made.mesh.faces)
    np.testing.assert_allclose(
        np.ptp(mesh.vertices, axis=0), np.ptp(made.mesh.vertices, axis=0), atol=1e-6
    )


def test_of_several_things_the_one_at_a_point(tmp_path: Path):
    path = write_room(tmp_path / "room.glb", room((AT, OTHER)))
    error = refused(path)
    assert error.code == "scan-several"
    assert "2 things" in error.what
    for at in (AT, OTHER):
        made = cut(path, at=np.array([*at, THING[2]]))
        np.testing.assert_allclose(made.T_world_object[:2, 3], at, atol=CELL)
    box = GivenBox(np.array([-1.6, 0.4, 0.0]), np.array([-0.8, 1.4, 1.0]))
    made = cut(path, box=box)
    np.testing.assert_allclose(made.T_world_object[:2, 3], OTHER, atol=CELL)


def test_the_places_that_an_error_lists_are_those_to_give(tmp_path: Path):
    path = write_room(tmp_path / "room.glb", room((AT, OTHER)))
    listed = [part.split(";")[0].rstrip(".") for part in refused(path).what.split(" m at ")[1:]]
    found = [cut(path, at=np.array([float(x) for x in one.split(",")])) for one in listed]
    assert len({tuple(made.T_world_object[:2, 3].round(1)) for made in found}) == 2


def test_what_cannot_be_cut_out_is_told(tmp_path: Path):
    path = write_room(tmp_path / "room.glb", room((AT, (AT[0] + THING[0] / 2, AT[1]))))
    assert refused(path, at=np.array([0.0, 0.0, 3.0])).code == "scan-nothing-there"
    empty = write_room(tmp_path / "empty.glb", room(()))
    assert refused(empty).code == "scan-no-object"
    outside = GivenBox(np.array([8.0, 8.0, 0.0]), np.array([9.0, 9.0, 1.0]))
    assert refused(path, box=outside).code in ("scan-box", "scan-no-floor")
    long = write_room(
        tmp_path / "long.glb",
        room(tuple((x, 0.0) for x in (-1.3, -0.9, -0.5, -0.1, 0.3, 0.7, 1.1))),
    )
    assert refused(long, at=np.array([0.0, 0.0, 0.6])).code == "scan-joined"


def test_up_is_the_axis_along_which_a_floor_is_level_unless_somebody_says_it(tmp_path: Path):
    path = write_room(tmp_path / "room.obj", room())
    (note,) = read_room(path).notes
    assert note.message.startswith("y is taken")
    with pytest.raises(InputError) as caught:
        cut_out(read_room(path, up="z"), "thing")
    assert caught.value.code in ("scan-no-floor", "scan-no-object")


def test_a_room_is_told_from_an_object():
    made = room()
    assert has_floor(np.asarray(made.vertices), np.asarray(made.faces, np.int64))
    for solid in (trimesh.creation.box((0.5, 0.4, 0.3)), trimesh.creation.annulus(0.2, 0.3, 0.5)):
        assert not has_floor(np.asarray(solid.vertices), np.asarray(solid.faces, np.int64))


def test_a_damaged_picture_is_told_and_costs_only_the_picture(tmp_path: Path):
    path = write_room(tmp_path / "room.obj", room())
    for file in tmp_path.glob("*.png"):
        file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    made = cut(path)
    assert made.mesh.texture is None
    assert [note.severity for note in made.mesh.notes if note.name == "texture"] == ["warn"]
