"""Tables of poses are read by the names of their columns, whoever wrote them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ingest.formats.registry import read_session
from tests.ingest.formats.logs import error_of

R = Rotation.from_euler("xyz", [0.3, -0.5, 1.1])
X, Y, Z, W = (f"{x:.9f}" for x in R.as_quat())

SPELLINGS = {
    "pandas": ("timestamp,x,y,z,qx,qy,qz,qw", "{t},{x},2,3,{X},{Y},{Z},{W}"),
    "pandas, with its index": (
        ",time,pos_x,pos_y,pos_z,rot_w,rot_x,rot_y,rot_z",
        "{i},{t},{x},2,3,{W},{X},{Y},{Z}",
    ),
    "w first": ("t,x,y,z,qw,qx,qy,qz", "{t},{x},2,3,{W},{X},{Y},{Z}"),
    "evo, other order": ("# timestamp qw qx qy qz tx ty tz", "{t} {W} {X} {Y} {Z} {x} 2 3"),
    "EuRoC": (
        "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
        "q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
        "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1]",
        "{ns}, {x}, 2, 3, {W}, {X}, {Y}, {Z}, 9, 9, 9, 9, 9, 9",
    ),
    "ROS": (
        "time,field.pose.position.x,field.pose.position.y,field.pose.position.z,"
        "field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,"
        "field.pose.orientation.w",
        "{t},{x},2,3,{X},{Y},{Z},{W}",
    ),
    "semicolons": ("Timestamp_ms;PX;PY;PZ;QX;QY;QZ;QW", "{ms};{x};2;3;{X};{Y};{Z};{W}"),
}


def _write(folder: Path, header: str, row: str, comments: str = "") -> Path:
    lines = [
        row.format(i=i, t=i / 10, ms=100 * i, ns=100_000_000 * i, x=1 + i / 100, X=X, Y=Y, Z=Z, W=W)
        for i in range(20)
    ]
    file = folder / "poses.csv"
    file.write_text(
        "\n".join([*([comments] if comments else []), *([header] if header else []), *lines, ""])
    )
    return file


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_columns_are_found_by_their_names(tmp_path: Path, spelling: str):
    session = read_session(_write(tmp_path, *SPELLINGS[spelling]))
    assert session.app == "CSV poses"
    np.testing.assert_allclose(session.times, np.arange(20) / 10, atol=1e-9)
    np.testing.assert_allclose(session.T_world_phone[:, :3, :3], [R.as_matrix()] * 20, atol=1e-8)
    np.testing.assert_allclose(session.T_world_phone[7, :3, 3], [1.07, 2, 3])
    assert not session.gravity_aligned
    assert session.camera_open


def test_comments_say_how_the_axes_point(tmp_path: Path):
    comments = "# axes: opencv\n# up: z"
    session = read_session(_write(tmp_path, *SPELLINGS["pandas"], comments))
    assert session.gravity_aligned
    assert not session.camera_open
    assert session.T_world_phone[0, :3, 3].tolist() == [1, 3, -2]


@pytest.mark.parametrize("app", ["ios_logger", "csv POSES"])
def test_eight_numbers_without_a_header_are_asked_about(tmp_path: Path, app: str):
    file = _write(tmp_path, "", "{t},{x},2,3,{X},{Y},{Z},{W}")
    error = error_of(file)
    assert error.code == "session-ambiguous"
    assert "ios_logger and CSV poses" in error.what
    assert '‹format› "ios_logger" or ‹format› "CSV poses"' in error.fix
    session = read_session(file, app)
    assert session.app.lower() == app.lower()
    same = np.allclose(session.T_world_phone[0, :3, :3], R.as_matrix(), atol=1e-6)
    assert same == (app != "ios_logger")


def test_a_format_that_is_named_decides(tmp_path: Path):
    file = _write(tmp_path, *SPELLINGS["pandas"])
    assert error_of(file, lambda path: read_session(path, "ARKitScenes")).code == "log-damaged"
    assert error_of(file, lambda path: read_session(path, "Stray")).code == "format-unknown"
