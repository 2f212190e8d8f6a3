"""The room's mesh that an app made joins a scan as depth, if it is in the world of the poses."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from ingest.axes import T_ZUP_ARKIT
from ingest.scan.mesh_sources import room_depth, room_file
from ingest.scan.room_parts import read_room_of_session
from ingest.scan.scan_types import Frame
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest.scan.orbiting import SIZE, box_points, registered, ring

LOW, HIGH = np.array([-0.2, -0.3, 0.0]), np.array([0.2, 0.3, 0.5])


@pytest.fixture
def filmed():
    poses = ring([0.0, 0.0, 0.25], count=12)
    found = registered(poses, box_points(np.random.default_rng(4), LOW, HIGH))
    T = inverse(poses)
    in_front = [
        (point, view)
        for view in range(len(poses))
        for point in range(len(found.points))
        if T[view, 2, :3] @ found.points[point] + T[view, 2, 3] < 1.25
    ]
    object.__setattr__(found, "observed", np.array(in_front, np.int64))
    frames = [Frame(v.name, v.file, SIZE, v.intrinsics, v.T_world_camera) for v in found.views]
    return found, frames


def _room(shift=0.0):
    """The box as an app has it: y up."""
    box = trimesh.creation.box(HIGH - LOW)
    vertices = np.asarray(box.vertices) + (LOW + HIGH) / 2 + [shift, 0.0, 0.0]
    return trimesh.Trimesh(vertices @ T_ZUP_ARKIT[:3, :3], box.faces, process=False)


def test_depth_is_that_of_the_surface_and_nothing_where_there_is_none(filmed, tmp_path):
    found, frames = filmed
    _room().export(tmp_path / "export.obj")
    (tmp_path / "part.ply").write_bytes(b"ply")
    file = room_file("app", tmp_path)
    assert file.name == "export.obj"
    maps = room_depth(read_room_of_session(file).surface, found, frames, str(file))
    assert len(maps) == len(found.views)
    # From above in front: the top's far edge is the farthest, its nearest corner the nearest.
    away = np.linalg.norm(found.views[0].T_world_camera[:3, 3] - [0.0, 0.0, 0.25])
    middle = maps[0][96, 128]
    assert away - 0.35 < middle < away
    assert (maps[0] == 0).mean() > 0.3


def test_views_without_a_logged_pose_have_no_depth(filmed):
    found, frames = filmed
    lost = [Frame(f.name, f.file, f.size, f.intrinsics) for f in frames[:1]] + frames[1:]
    turned = _room().copy()
    turned.vertices = np.asarray(turned.vertices) @ T_ZUP_ARKIT[:3, :3].T
    maps = room_depth(turned, found, lost, "room")
    assert not maps[0].any()
    assert maps[1].any()


def test_a_mesh_of_another_world_is_refused(filmed):
    found, frames = filmed
    with pytest.raises(InputError) as refused:
        room_depth(_room(), found, frames, "room")  # Still y up: lying on its side.
    assert refused.value.code == "scan-mesh-elsewhere"


def test_a_session_without_a_mesh_is_told_of(tmp_path):
    for said in ("app", str(tmp_path / "gone.obj")):
        with pytest.raises(InputError) as refused:
            room_file(said, tmp_path)
        assert refused.value.code == "scan-mesh-missing"
    bad = tmp_path / "bad.obj"
    bad.write_text("v 0 0 0\n")
    with pytest.raises(InputError):
        read_room_of_session(Path(bad))
