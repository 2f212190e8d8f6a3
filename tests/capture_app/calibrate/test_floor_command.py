"""`omocap calibrate floor`: a rough mount and a take in, a better mount out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.cli.calibrate import floor
from capture_app.inspection import inspect_take
from capture_app.simulator.demo_take import (
    HEIGHT,
    MESH,
    MOUNT,
    SESSION,
    box_mesh,
    clamped_phone,
    record_demo,
)
from ingest.mount import Mount, object_id
from ingest.mount_file import load_mount, save_mount
from ingest.uncertainty import moved
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The demonstration take without its video."""
    folder = tmp_path_factory.mktemp("demo")
    record_demo(folder, video=False)
    return folder


def _rough(folder: Path) -> Path:
    """The mount off by 3 degrees and 3 cm, by hand."""
    step = np.array([*np.radians([2, -2, 1]), 0.02, -0.02, 0.01])
    T = moved(clamped_phone().T_phone_object, step)
    save_mount(Mount(T, "measured by hand"), folder / "rough.json")
    return folder / "rough.json"


def _lens() -> float:
    """Metres of the lens over the floor where the box stands."""
    return HEIGHT / 2 + float(inverse(clamped_phone().T_phone_object)[2, 3])


def _lean(mount: Mount) -> float:
    """Degrees by which the box's own z axis is off."""
    a, b = (m.T_phone_object[:3, 2] for m in (mount, clamped_phone()))
    return float(np.degrees(np.arccos(np.clip(a @ b, -1, 1))))


def test_a_rough_mount_becomes_upright_and_as_high_as_the_tape_says(
    demo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    rough, fine = _rough(tmp_path), tmp_path / "fine.json"
    floor(
        mount=rough,
        session=demo / SESSION,
        mount_file=fine,
        object=demo / MESH,
        phone_height=_lens(),
    )
    found = load_mount(fine)
    assert _lean(load_mount(rough)) > 2
    assert _lean(found) < 0.4
    bottom = [
        (m.T_phone_object @ [0, 0, -HEIGHT / 2, 1])[:3] @ clamped_phone().T_phone_object[:3, 2]
        for m in (found, clamped_phone())
    ]
    assert abs(bottom[0] - bottom[1]) < 0.01
    assert found.method == "measured by hand, refined by the floor"
    assert found.object_id == object_id(box_mesh())
    printed = capsys.readouterr().out
    assert "The floor fixed the tilt to" in printed
    assert "from 2 rests and 0 pushes on 1 side" in printed
    assert "the phone's height over the floor" in printed
    assert "5 deg and 50 mm on each axis were assumed" in printed


def test_a_floor_that_contradicts_writes_nothing(demo: Path, tmp_path: Path):
    mount = clamped_phone()
    tilted = mount.T_phone_object.copy()
    tilted[:3, :3] = tilted[:3, :3] @ Rotation.from_euler("x", 5, degrees=True).as_matrix()
    sure = np.diag([np.radians(0.3) ** 2] * 3 + [0.002**2] * 3)
    save_mount(replace(mount, T_phone_object=tilted, covariance=sure), tmp_path / "sure.json")
    with pytest.raises(InputError) as caught:
        floor(
            mount=tmp_path / "sure.json",
            session=demo / SESSION,
            mount_file=tmp_path / "out.json",
            object=demo / MESH,
        )
    assert caught.value.code == "floor-contradicts-mount"
    assert caught.value.where == str(demo / SESSION)
    assert not (tmp_path / "out.json").exists()


def test_a_mesh_of_another_size_is_the_object_at_the_mount_s_scale(demo: Path, tmp_path: Path):
    """A mesh in the units of a scan that knows no metres, and the mount that found its scale."""
    small = trimesh.load_mesh(demo / MESH)
    small.apply_scale(0.8)
    small.export(tmp_path / "box.obj")
    scaled = replace(load_mount(demo / MOUNT), object_scale=1.25, object_id="")
    save_mount(scaled, tmp_path / "mount.json")
    seen = inspect_take(demo / SESSION, tmp_path / "box.obj", tmp_path / "mount.json")
    true = inspect_take(demo / SESSION, demo / MESH, demo / MOUNT)
    assert seen.mesh is not None
    assert true.mesh is not None
    np.testing.assert_allclose(np.ptp(seen.mesh.vertices, 0), np.ptp(true.mesh.vertices, 0))
    assert seen.take is not None
    assert true.take is not None
    assert seen.take.floor.height == pytest.approx(true.take.floor.height, abs=1e-6)
    fine = tmp_path / "fine.json"
    floor(
        mount=tmp_path / "mount.json",
        session=demo / SESSION,
        mount_file=fine,
        object=tmp_path / "box.obj",
        phone_height=_lens(),
    )
    found = load_mount(fine)
    assert found.object_scale == 1.25
    assert found.object_id.startswith("box, 28 x 36 x 24 cm")
    again = inspect_take(demo / SESSION, tmp_path / "box.obj", fine)
    checks = {check.name: check for check in again.report.checks}
    assert checks["mount's object"].severity == "ok"
