"""What logs state about themselves: headers, units, order of quaternions, confidence, cameras, versions."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ingest.formats import nerfstudio, polycam, record3d, scan_capture, stray_scanner
from ingest.formats.registry import read_session
from ingest.formats.still_images import confidence_of, save_millimetres, sure
from tests.ingest.formats.logs import MakeTake, edit_json, error_of, with_pictures
from tests.log_writers import write_session

R = Rotation.from_euler("xyz", [0.3, -0.5, 1.1])
VALUES = dict(zip("XYZW", (f"{x:.9f}" for x in R.as_quat()), strict=True))


def table(file: Path, header: str, row: str, step: float = 1 / 60) -> Path:
    """Write 90 poses that move 1 cm each along x, stamped 60 times a second."""
    lines = [
        row.format(t=k * step, us=round(k * step * 1e6), ns=round(k * step * 1e9), x=1 + k / 100,
                   mm=1000 + 10 * k, cm=100 + k, sec=int(k * step),
                   nsec=round(k * step * 1e9) % 10**9, **VALUES)
        for k in range(90)
    ]  # fmt: skip
    file.write_text("\n".join([*([header] if header else []), *lines, ""]))
    return file


PQ = "{x} 2 3 {X} {Y} {Z} {W}"
STATED = {
    "TUM with a header": ("timestamp tx ty tz qx qy qz qw", f"{{t}} {PQ}"),
    "TUM in nanoseconds": ("# timestamp tx ty tz qx qy qz qw", f"{{ns}} {PQ}"),
    "TUM in microseconds without a header": ("", f"{{us}} {PQ}"),
    "a header of blanks over commas": (
        "# timestamp qw qx qy qz tx ty tz",
        "{t},{W},{X},{Y},{Z},{x},2,3",
    ),
    "microseconds and w first": (
        "time [µs],q_w,q_x,q_y,q_z,p_x [m],p_y [m],p_z [m]",
        "{us},{W},{X},{Y},{Z},{x},2,3",
    ),
    "millimetres": ("t,x_mm,y_mm,z_mm,qx,qy,qz,qw", "{t},{mm},2000,3000,{X},{Y},{Z},{W}"),
    "centimetres": (
        "#timestamp [ns], tx [cm], ty [cm], tz [cm], qx, qy, qz, qw",
        "{ns}, {cm}, 200, 300, {X}, {Y}, {Z}, {W}",
    ),
    "EuRoC, whose stamps are nanoseconds and whose header does not say so": (
        "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []",
        "{ns},{x},2,3,{W},{X},{Y},{Z}",
    ),
    "rostopic echo -p": (
        "%time,field.header.stamp,field.pose.position.x,field.pose.position.y,field.pose.position.z,"
        "field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,"
        "field.pose.orientation.w",
        "7,{ns},{x},2,3,{X},{Y},{Z},{W}",
    ),
    "ROS 2, seconds and nanoseconds": (
        "header.stamp.sec,header.stamp.nanosec,position.x,position.y,position.z,"
        "orientation.x,orientation.y,orientation.z,orientation.w",
        "{sec},{nsec},{x},2,3,{X},{Y},{Z},{W}",
    ),
}


@pytest.mark.parametrize("spelling", STATED)
def test_headers_units_and_orders(tmp_path: Path, spelling: str):
    session = read_session(table(tmp_path / "poses.txt", *STATED[spelling]))
    np.testing.assert_allclose(session.times - session.times[0], np.arange(90) / 60, atol=2e-6)
    np.testing.assert_allclose(session.T_world_phone[30, :3, 3], [1.3, 2, 3], atol=1e-9)
    turned = session.T_world_phone[0, :3, :3]
    flipped = turned @ np.diag([1, -1, -1])  # TUM's camera has OpenCV's axes
    assert min(np.abs(turned - R.as_matrix()).max(), np.abs(flipped - R.as_matrix()).max()) < 1e-6
    assert all("taken for" in note for note in session.notes)


@pytest.mark.parametrize(
    ("header", "row", "code"),
    [
        ("t,x,y,z,qx,qy,qz,qz", "{t},{x},2,3,{X},{Y},{Z},{W}", "header-unclear"),
        ("# t x y z qx qy qz qx", "{t} {x} 2 3 {X} {Y} {Z} {W}", "header-unclear"),
        ("t,x_mm,y_m,z_m,qx,qy,qz,qw", "{t},{x},2,3,{X},{Y},{Z},{W}", "header-unclear"),
        ("t,x,y,z,qx,qy,qz,qw", "{t},{x},2,3,{X},{Y},{Z},{W},9", "header-width"),
        ("t [ns],x,y,z,qx,qy,qz,qw", "{t},{x},2,3,{X},{Y},{Z},{W}", "units-unclear"),
        ("t [s],x,y,z,qx,qy,qz,qw", "{ns},{x},2,3,{X},{Y},{Z},{W}", "units-unclear"),
    ],
)
def test_a_header_that_contradicts_is_refused(tmp_path: Path, header: str, row: str, code: str):
    assert error_of(table(tmp_path / "poses.csv", header, row)).code == code


W_FIRST = "{t} {x} 2 3 {W} {X} {Y} {Z}"


@pytest.mark.parametrize(
    "said",
    [
        "# quaternion order: wxyz",
        "# timestamp position(x y z) quaternion(w x y z)",
        "# time [s], place [m], rotation as (w, x, y, z)",
        "# t x y z qw qx qy qz",
    ],
)
def test_prose_says_the_order_of_quaternions(tmp_path: Path, said: str):
    session = read_session(table(tmp_path / "poses.txt", said, W_FIRST))
    turned = session.T_world_phone[0, :3, :3]
    flipped = turned @ np.diag([1, -1, -1])
    assert min(np.abs(turned - R.as_matrix()).max(), np.abs(flipped - R.as_matrix()).max()) < 1e-6
    usual = table(tmp_path / "poses.txt", "# (x, y, z) and (x, y, z, w)", f"{{t}} {PQ}")
    again = read_session(usual).T_world_phone[0, :3, :3] @ np.diag([1, -1, -1])
    np.testing.assert_allclose(again, R.as_matrix(), atol=1e-6)


def test_the_header_of_the_rows_counts_more_than_a_comment(tmp_path: Path):
    both = "# t x y z qx qy qz qw\nt,x,y,z,qw,qx,qy,qz"
    session = read_session(table(tmp_path / "poses.csv", both, W_FIRST.replace(" ", ",")))
    np.testing.assert_allclose(session.T_world_phone[0, :3, :3], R.as_matrix(), atol=1e-6)


def test_left_handed_axes_are_refused(tmp_path: Path):
    file = table(tmp_path / "poses.txt", "# Unity, left-handed", f"{{t}} {PQ}")
    assert error_of(file).code == "axes-unknown"


def test_a_decimal_comma_is_named(tmp_path: Path):
    row = f"{{t}};{PQ.replace(' ', ';')}"
    file = table(tmp_path / "poses.csv", "t;x;y;z;qx;qy;qz;qw", row)
    file.write_text(file.read_text().replace(".", ","))
    error = error_of(file)
    assert error.code == "log-decimal-comma"
    assert error.where.endswith(":2")


@pytest.mark.parametrize("coding", ["utf-16", "utf-8-sig"])
def test_text_says_its_coding(tmp_path: Path, coding: str):
    """PowerShell writes UTF-16 where a program's output is redirected."""
    file = table(tmp_path / "poses.txt", "# t x y z qx qy qz qw", f"{{t}} {PQ}")
    file.write_bytes(file.read_text().encode(coding))
    np.testing.assert_allclose(read_session(file).T_world_phone[30, :3, 3], [1.3, 2, 3])


def test_poses_without_times_are_no_scene_of_arkitscenes(tmp_path: Path):
    """Seven numbers, of which the first may pass for a time that runs on."""
    error = error_of(table(tmp_path / "poses.traj", "", "{x} {t} 3 {X} {Y} {Z} {W}"))
    assert error.code == "session-unknown"


def test_scan_capture_by_its_header(take: MakeTake, tmp_path: Path):
    folder = write_session(scan_capture, take(0), tmp_path)
    before = read_session(folder)
    log = folder / "poses.txt"
    rows = [line.split(", ") for line in log.read_text().strip().split("\n")]
    order = [5, 6, 7, 8, 1, 0, 2, 3, 4, *range(9, 16)]
    rows[0][0] = "timestamp"
    log.write_text("\n".join(("# " if k == 0 else "") + ", ".join(row[c] for c in order)
                             for k, row in enumerate(rows)) + "\n")  # fmt: skip
    after = read_session(folder)
    assert after.app == "ScanCapture"
    np.testing.assert_array_equal(after.T_world_phone, before.T_world_phone)
    np.testing.assert_array_equal(after.times, before.times)


LEVELS = np.array([[0, 1, 2], [2, 1, 0]], np.uint8)


@pytest.mark.parametrize("middle", [54, 127, 128])
def test_confidence_beside_depth_in_each_layout(tmp_path: Path, middle: int):
    """ARKit counts 0, 1, 2; Polycam writes 0, 127, 255, and since 2026 0, 54, 255."""
    for depth, beside, top in (
        ("a/depth_00003.png", "a/conf_00003.png", 2),
        ("b/depth/000003.png", "b/confidence/000003.png", 2),
        ("c/depth/17.png", "c/confidence/17.png", 255),
        ("d/depth/17.bin", "d/depth/17.confidence.png", 2),
    ):
        (tmp_path / depth).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / beside).parent.mkdir(parents=True, exist_ok=True)
        scaled = LEVELS if top == 2 else np.array([0, middle, 255], np.uint8)[LEVELS]
        cv2.imwrite(str(tmp_path / beside), scaled)
        found = confidence_of(tmp_path / depth)
        assert found is not None
        np.testing.assert_array_equal(found, LEVELS)
        np.testing.assert_array_equal(sure(np.ones((2, 3), np.float32), found), LEVELS > 0)
    assert confidence_of(tmp_path / "a" / "other.png") is None


def test_a_session_has_no_depth_where_it_is_not_sure(take: MakeTake, tmp_path: Path):
    """Floor and scan read depth by the session alone; a map without its confidence is not sure."""
    session = replace(take(0), video=None)
    folder = stray_scanner.write(session, tmp_path)
    for name in ("depth", "confidence"):
        (folder / name).mkdir(exist_ok=True)
    for k in range(3):
        save_millimetres(np.full((4, 6), 1.5, np.float32), folder / f"depth/{k:06d}.png")
    cv2.imwrite(str(folder / "confidence/000000.png"), np.kron(LEVELS, np.ones((2, 2), np.uint8)))
    cv2.imwrite(str(folder / "confidence/000001.png"), LEVELS)  # half as large
    depth = read_session(folder).depth
    maps = [depth.load(file) for file in depth.files]
    for seen in maps[:2]:
        np.testing.assert_array_equal(seen > 0, np.kron(LEVELS, np.ones((2, 2))) > 0)
    assert not maps[2].any()
    shutil.rmtree(folder / "confidence")
    depth = read_session(folder).depth
    assert all((depth.load(file) == 1.5).all() for file in depth.files)


def _edit_each(folder: Path, change: Callable[[dict], object]) -> None:
    for file in folder.glob("*.json"):
        edit_json(file, change)


def test_polycam_since_november_2025(take: MakeTake, tmp_path: Path):
    """Corrected cameras have no size, and there are no corrected images (nerfstudio PR 3725)."""
    session = with_pictures(take(0), tmp_path / "pictures")
    folder = write_session(polycam, session, tmp_path / "take") / "keyframes"
    shutil.copytree(folder / "cameras", folder / "corrected_cameras")
    drop = lambda values: [values.pop(key) for key in ("width", "height")]  # noqa: E731
    _edit_each(folder / "corrected_cameras", drop)
    back = read_session(folder.parent)
    assert back.image_size == session.image_size
    np.testing.assert_allclose(back.intrinsics, session.intrinsics)
    assert {image.parent.name for image in back.images} == {"images"}
    _edit_each(folder / "cameras", drop)
    height, width = cv2.imread(str(back.images[0])).shape[:2]
    assert read_session(folder.parent).image_size == (width, height)


def test_record3d_of_2022(take: MakeTake, tmp_path: Path):
    """It wrote poses, K, w, h and fps alone (marek-simonik/record3d issues 27 and 33)."""
    folder = write_session(record3d, take(0), tmp_path)
    before = read_session(folder)
    always = ("poses", "K", "w", "h", "fps")
    log = folder / "metadata"
    values = json.loads(log.read_text())
    log.write_text(json.dumps({key: values[key] for key in always} | {"unknown": 1}))
    back = read_session(folder)
    assert back.app == "Record3D"
    np.testing.assert_array_equal(back.T_world_phone, before.T_world_phone)
    np.testing.assert_allclose(np.diff(back.times), 1 / values["fps"])


def test_record3d_held_sideways(take: MakeTake, tmp_path: Path):
    """Since 1.10.1 images, K and poses are those of the landscape image (notmahi/dobb-e PR 11)."""
    session = take(0)
    T = np.linalg.inv(session.T_world_phone[0]) @ session.T_world_phone
    quaternions = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    metadata = {
        "poses": np.concatenate([quaternions, T[:, :3, 3]], axis=1).tolist(),
        "K": [700, 0, 0, 0, 700, 0, 481, 359, 1], "w": 960, "h": 720, "fps": 30,
        "cameraType": 1,
    }  # fmt: skip
    (tmp_path / "metadata").write_text(json.dumps(metadata))
    (tmp_path / "rgbd").mkdir()
    cv2.imwrite(str(tmp_path / "rgbd/0.jpg"), np.zeros((72, 96, 3), np.uint8))
    back = read_session(tmp_path)
    np.testing.assert_allclose(back.T_world_phone, T, atol=1e-12)
    assert (back.image_size, back.image_turns) == ((960, 720), 0)
    np.testing.assert_array_equal(back.intrinsics[0], [700, 700, 481, 359])
    cv2.imwrite(str(tmp_path / "rgbd/0.jpg"), np.zeros((96, 72, 3), np.uint8))
    assert error_of(tmp_path).code == "record3d-turned"


@pytest.mark.parametrize("scale", [0.5, 12.5])
def test_nerfstudio_undoes_its_scale_and_then_its_transform(
    take: MakeTake, tmp_path: Path, scale: float
):
    """nerfstudio applies applied_transform, then applied_scale (its base_dataparser.py undoes both)."""
    session = take(0)
    folder = write_session(nerfstudio, session, tmp_path)
    before = read_session(folder)
    applied = np.array([[1, 0, 0, 0.4], [0, 0, -1, -1.5], [0, 1, 0, 2.0], [0, 0, 0, 1]])

    def change(values: dict) -> None:
        values |= {"applied_transform": applied[:3].tolist(), "applied_scale": scale}
        for frame, T in zip(values["frames"], session.T_world_phone, strict=True):
            moved = applied @ T
            moved[:3, 3] *= scale
            frame["transform_matrix"] = moved.tolist()

    edit_json(folder / "transforms.json", change)
    np.testing.assert_allclose(read_session(folder).T_world_phone, before.T_world_phone, atol=1e-9)
    edit_json(folder / "transforms.json", lambda v: v.update(applied_scale=0))
    assert "applied_scale" in error_of(folder).what


def test_nerfstudio_cameras_of_frames_and_of_other_lenses(take: MakeTake, tmp_path: Path):
    folder = write_session(nerfstudio, take(0), tmp_path)
    log = folder / "transforms.json"

    def own(values: dict) -> None:
        for frame in values["frames"]:
            for key in ("fl_x", "fl_y", "cx", "cy", "w", "h"):
                frame.pop(key, None)
        values |= {"camera_angle_x": 1.0, "w": 640, "h": 480}
        values["frames"][3] |= {"fl_x": 500.0, "cx": 321.0}

    edit_json(log, own)
    session = read_session(folder)
    fl = 320 / np.tan(0.5)
    np.testing.assert_allclose(session.intrinsics[0], [fl, fl, 320, 240])
    np.testing.assert_allclose(session.intrinsics[3], [500, 500, 321, 240])
    edit_json(log, lambda v: v.update(camera_model="OPENCV_FISHEYE"))
    session = read_session(folder)
    assert session.intrinsics is None
    assert "OPENCV_FISHEYE" in session.notes[0]
