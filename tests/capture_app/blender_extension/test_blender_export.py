"""The export of an animated object from Blender: its own part, and its talk with a made-up Blender."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from capture_app.blender_extension import blender_export as export
from ingest.animated.animated_take import to_animated_take
from ingest.animated.detect import read_animation

BOX = trimesh.creation.box((1, 1, 1))


def world(scale: tuple[float, float, float], frames: int = 49) -> np.ndarray:
    s = np.linspace(0, 1, frames)
    T = np.tile(np.eye(4), (frames, 1, 1))
    turn = Rotation.from_rotvec(np.outer(s, [0.4, 0.3, 4.0])).as_matrix()
    T[:, :3, :3] = turn @ np.diag(scale)
    T[:, :3, 3] = np.stack([s, 0.5 * s, 1 + s], axis=1)
    return T


@given(st.tuples(*[st.floats(0.1, 2.0)] * 3), st.sampled_from([1, -1]))
@settings(max_examples=15)
def test_what_is_exported_is_read_as_blender_showed_it(tmp_path_factory, scale, mirror):
    T = world((mirror * scale[0], *scale[1:]))
    path = tmp_path_factory.mktemp("out") / "a.glb"
    path.write_bytes(export.glb("Chair", T, BOX.vertices, BOX.faces, 30.0))
    take = to_animated_take(read_animation(path), None, floor=0.0)
    made = take.motion.T_world_object
    mesh = take.motion.mesh
    for k in (0, 20, 48):
        expected = BOX.vertices @ T[k, :3, :3].T + T[k, :3, 3]
        found = mesh.vertices @ made[k, :3, :3].T + made[k, :3, 3]
        ordered = [np.unique(points.round(4), axis=0) for points in (found, expected)]
        np.testing.assert_allclose(ordered[0], ordered[1], atol=2e-4)
    assert trimesh.Trimesh(mesh.vertices, mesh.faces).volume > 0


def test_units_of_the_scene_become_metres(tmp_path):
    T = world((40, 40, 40))
    T[:, :3, 3] *= 100
    (tmp_path / "a.glb").write_bytes(export.glb("Box", T, BOX.vertices, BOX.faces, 24.0, 0.01))
    read = read_animation(tmp_path / "a.glb")
    assert len(read.valid) == 61
    np.testing.assert_allclose(np.ptp(read.mesh.vertices, axis=0), 0.4, atol=1e-6)
    np.testing.assert_allclose(read.T_file_object[-1, :3, 3], [1, 2, -0.5], atol=1e-5)


def test_what_changes_its_shape_is_not_exported():
    T = world((1, 1, 1))
    T[30:, :3, 0] *= 1.2
    with pytest.raises(SystemExit, match="frame 30"):
        export.glb("Box", T, BOX.vertices, BOX.faces, 24.0)


class FakeMesh:
    def __init__(self) -> None:
        self.vertices = FakeList(BOX.vertices)
        self.loop_triangles = FakeList(BOX.faces)

    def calc_loop_triangles(self) -> None:
        """Blender computes them here."""


class FakeList:
    def __init__(self, rows: np.ndarray) -> None:
        self.rows = rows

    def __len__(self) -> int:
        return len(self.rows)

    def foreach_get(self, name: str, out: np.ndarray) -> None:
        assert name in ("co", "vertices")
        out[:] = self.rows.ravel()


class FakeScene:
    """A chair with a cushion on it, keyed in frames 1 to 49."""

    def __init__(self) -> None:
        self.frame_start, self.frame_end, self.frame_current = 1, 49, 7
        self.render = SimpleNamespace(fps=24, fps_base=1.0)
        self.unit_settings = SimpleNamespace(scale_length=1.0)
        cushion = FakeObject(self, "Cushion", [0, 0, 1], [])
        self.objects = [FakeObject(self, "Chair", [0, 0, 0], [cushion]), cushion]

    def frame_set(self, frame: int) -> None:
        self.frame_current = frame


class FakeObject:
    type = "MESH"

    def __init__(self, scene: FakeScene, name: str, offset: list[float], children: list) -> None:
        self.scene, self.name, self.children_recursive = scene, name, children
        self.offset = np.eye(4)
        self.offset[:3, 3] = offset

    def evaluated_get(self, graph: object) -> "FakeObject":
        return self

    @property
    def matrix_world(self) -> np.ndarray:
        return world((0.5, 0.5, 0.5))[self.scene.frame_current - 1] @ self.offset

    def to_mesh(self) -> FakeMesh:
        return FakeMesh()

    def to_mesh_clear(self) -> None:
        """Blender frees it here."""


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> FakeScene:
    made = FakeScene()
    bpy = ModuleType("bpy")
    bpy.context = SimpleNamespace(  # type: ignore[attr-defined]
        scene=made, object=made.objects[0], evaluated_depsgraph_get=lambda: None
    )
    by_name = {thing.name: thing for thing in made.objects}
    bpy.data = SimpleNamespace(objects=by_name)  # type: ignore[attr-defined]
    bpy.path = SimpleNamespace(abspath=lambda _: str(tmp_path))  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "bpy", bpy)
    return made


def test_the_script_samples_the_scene(scene, tmp_path, capsys):
    export.main(["--object", "Chair", "--out", str(tmp_path / "a.glb")])
    assert "49 frames at 24 fps" in capsys.readouterr().out
    assert scene.frame_current == 7
    read = read_animation(tmp_path / "a.glb")
    assert read.mesh.name == "Chair"
    np.testing.assert_allclose(np.ptp(read.mesh.vertices, axis=0), [0.5, 1.0, 0.5], atol=1e-6)
    export.main(["--start", "1", "--end", "25"])
    assert len(read_animation(tmp_path / "Chair.glb").valid) == 31


def test_an_unknown_object_is_named(scene):
    with pytest.raises(SystemExit, match="Chair, Cushion"):
        export.main(["--object", "Sofa"])
