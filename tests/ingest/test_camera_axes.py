"""A log that does not say which axes its camera has is read so that the object stands at rest."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_app.inspection import Inspection, inspect_take, refuse_bad
from capture_app.simulator.demo_take import clamped_phone
from ingest.formats import pose_table, tum
from ingest.mount_file import save_mount
from ingest.session import CaptureSession
from ingest.trajectory.trajectory_config import Reading
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest import good_take as go
from tests.ingest.good_take import Take

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def good() -> CaptureSession:
    """A take whose phone is clamped askew, so that only one reading makes the box stand."""
    return go.without_imu(go.make_session())


def _written(folder: Path, session: CaptureSession, format_, *, askew: bool, drop: str) -> Take:
    """The files, without the comments that say how the axes point."""
    folder.mkdir(exist_ok=True)
    take = go.make_take(folder, session)
    mount, clamped = clamped_phone(), np.eye(4)
    angles = [40, 25, 10] if askew else [30, 0, 0]
    clamped[:3, :3] = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
    clamped[:3, 3] = mount.T_phone_object[:3, 3]
    turn = mount.T_phone_object @ inverse(clamped)
    save_mount(replace(mount, T_phone_object=clamped), take.mount)
    take.write(go.posed(session, session.T_world_phone @ turn), format_)
    for log in take.session.iterdir():
        lines = log.read_text().split("\n")
        log.write_text("\n".join(line for line in lines if not line.startswith(drop)))
    return take


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("format_", [pose_table, tum], ids=lambda f: f.NAME)
def test_the_axes_are_those_with_which_the_object_stands(tmp_path: Path, good, format_, flipped):
    sound = _written(tmp_path / "a", good, format_, askew=True, drop="# none")
    expected = inspect_take(sound.session, sound.mesh, sound.mount).take
    open_ = _written(tmp_path / "b", good, format_, askew=True, drop="# axes")
    if flipped:  # written with the axes that are not usual for the format
        log = next(open_.session.iterdir())
        log.write_text(_flipped(log.read_text(), "," if format_ is pose_table else " "))
    seen = inspect_take(open_.session, open_.mesh, open_.mount)
    _check_standing(seen)
    assert seen.take is not None
    assert expected is not None
    np.testing.assert_allclose(
        seen.take.motion.T_world_object, expected.motion.T_world_object, atol=1e-4
    )
    assert any("which axes its camera has" in note for note in seen.take.notes)


def _check_standing(seen: Inspection) -> None:
    """It stands; where the phone is on the object is made up here."""
    assert seen.problem is None
    assert [check.severity for check in seen.report.checks if check.name == "standing"] == ["ok"]


def _flipped(text: str, separator: str) -> str:
    """The same poses with the camera's axes turned by half a turn about x."""
    lines: list[str] = []
    for line in text.split("\n"):
        fields = line.split(separator)
        if len(fields) == 8 and not line.startswith("#") and fields[1] != "x":
            R = Rotation.from_quat([float(x) for x in fields[4:]]).as_matrix() @ FLIP[:3, :3]
            xyzw = Rotation.from_matrix(R).as_quat()
            line = separator.join([*fields[:4], *(f"{x:.9f}" for x in xyzw)])
        lines.append(line)
    return "\n".join(lines)


@pytest.mark.parametrize("format_", [pose_table, tum], ids=lambda f: f.NAME)
def test_where_it_stands_with_both_its_user_is_asked(tmp_path: Path, good, format_):
    """The phone's x axis is along the box: half a turn about it puts the box on its other side."""
    take = _written(tmp_path, good, format_, askew=False, drop="# axes")
    seen = inspect_take(take.session, take.mesh, take.mount)
    with pytest.raises(InputError) as caught:
        refuse_bad(seen)
    assert caught.value.code == "axes-unknown"
    assert "# axes: arkit" in caught.value.fix


def test_a_given_up_is_heeded(tmp_path: Path, good):
    take = _written(tmp_path, good, pose_table, askew=True, drop="# ")
    for up in ((0.0, 1.0, 0.0), "object:z"):
        seen = inspect_take(take.session, take.mesh, take.mount, reading=Reading(up=up))
        _check_standing(seen)
    wrong = inspect_take(take.session, take.mesh, take.mount, reading=Reading(up=(1.0, 1.0, 0.0)))
    assert wrong.verdict == "not usable"


@pytest.mark.parametrize("drop", ["# axes", "# "])
@pytest.mark.parametrize("format_", [pose_table, tum], ids=lambda f: f.NAME)
def test_without_the_object_the_phone_is_looked_at_as_it_is_read(
    tmp_path: Path, good, format_, drop: str
):
    take = _written(tmp_path, good, format_, askew=True, drop=drop)
    seen = inspect_take(take.session)
    refuse_bad(seen)
    assert seen.verdict != "not usable"
