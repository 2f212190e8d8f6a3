"""Files that are damaged, mixed up or in other units: an error, or a check, says so; never a motion.

The faults of logs that read well are in test_semantic_faults.py.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.inspection import refuse_bad
from capture_app.simulator.demo_take import clamped_phone
from ingest.formats import arkit_data_logger, ios_logger, stray_scanner
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest import good_take as go
from tests.ingest.good_take import Take
from tests.log_writers import write_session

COLUMNS = ["t", "frame", "x", "y", "z", "qx", "qy", "qz", "qw"]


def edit(column: str, value, first: int = 100, last: int = 101) -> Callable[[Take], None]:
    """Put other values into lines of odometry.csv."""

    def change(take: Take) -> None:
        lines = take.log.read_text().split("\n")
        for at in range(first, last):
            fields = lines[at].split(", ")
            fields[COLUMNS.index(column)] = value(fields) if callable(value) else value
            lines[at] = ", ".join(fields)
        take.log.write_text("\n".join(lines))

    return change


def lines(change: Callable[[list[str]], list[str]]) -> Callable[[Take], None]:
    def apply(take: Take) -> None:
        take.log.write_text("\n".join(change(take.log.read_text().split("\n"))))

    return apply


def mount(change: Callable[[np.ndarray], np.ndarray], **more) -> Callable[[Take], None]:
    def apply(take: Take) -> None:
        T = change(clamped_phone().T_phone_object.copy())
        take.mount.write_text(json.dumps({"T_phone_object": T.tolist(), "method": "x", **more}))

    return apply


def offset(scale: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda T: np.block([[T[:3, :3], scale * T[:3, 3:]], [T[3:]]])


def mesh(change: Callable[[trimesh.Trimesh], trimesh.Trimesh]) -> Callable[[Take], None]:
    def apply(take: Take) -> None:
        change(trimesh.load_mesh(take.mesh)).export(take.mesh)

    return apply


def _video(take: Take, frames: int) -> None:
    with av.open(str(take.session / "rgb.mp4"), "w") as container:
        stream = container.add_stream("libx264", rate=60)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.time_base = Fraction(1, 60)
        for k in range(frames):
            frame = av.VideoFrame.from_ndarray(np.zeros((48, 64, 3), np.uint8), format="rgb24")
            frame.pts = k
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def _two_sessions(take: Take) -> None:
    for name in ("one", "two"):
        stray_scanner.write(take.good, take.session / name)
    take.log.unlink()


def _as_other_app(take: Take) -> None:
    write_session(ios_logger, take.good, take.folder / "other")
    take.log.write_bytes((take.folder / "other" / "ARposes.txt").read_bytes())


def _emptied(take: Take) -> None:
    for file in take.session.iterdir():
        file.unlink()


def _left_handed(take: Take) -> None:
    _emptied(take)
    write_session(arkit_data_logger, take.good, take.session)
    log = take.session / "ARKit_camera_pose.txt"
    rows = [line.split() for line in log.read_text().split("\n")[1:-1]]
    for row in rows:
        row[1:4] = [f"{-float(x):.6f}" for x in row[1:4]]
    log.write_text("# log\n" + "\n".join(map(" ".join, rows)) + "\n")


def _swap_x_qx(take: Take) -> None:
    rows = [line.split(", ") for line in take.log.read_text().split("\n")]
    x, qx = COLUMNS.index("x"), COLUMNS.index("qx")
    for row in rows[1:-1]:
        row[x], row[qx] = row[qx], row[x]
    take.log.write_text("\n".join(", ".join(row) for row in rows))


def _one_late(take: Take) -> None:
    late = 3e7 * (np.arange(len(take.good.times)) > go.AT)
    take.write(go.timed(take.good, take.good.times + late))


def _inverse_mount(take: Take) -> None:
    """Of a phone that is turned: that of the good take is nearly its own inverse."""
    session = go.turned_camera(take.good, "zx", (90, 40))
    take.write(go.without_imu(session))
    (take.session / "imu.csv").unlink()
    T_turned_phone = inverse(session.T_world_phone[0]) @ take.good.T_world_phone[0]
    mount(lambda T: inverse(T_turned_phone @ T))(take)


def _turned_mount(T: np.ndarray) -> np.ndarray:
    T[:3, :3] = T[:3, :3] @ Rotation.from_euler("x", 25, degrees=True).as_matrix()
    return T


@dataclass(frozen=True)
class Fault:
    name: str
    corrupt: Callable[[Take], object]
    told: str
    """Code of the error or name of the check."""
    kind: str = "error"
    """Or "bad" or "warn": the severity of the check."""
    line: int | None = None
    """Of odometry.csv."""


FAULTS = [
    Fault("NaN", edit("y", "nan"), "log-not-finite", line=101),
    Fault("infinity", edit("qx", "-inf"), "log-not-finite", line=101),
    Fault("no number", edit("z", "n/a"), "log-damaged", line=101),
    Fault("empty time", edit("t", ""), "log-damaged", line=101),
    Fault("quaternion not unit", edit("qw", "0.9"), "pose-not-unit", line=101),
    Fault("quaternion of zeros",
          lambda t: [edit(q, "0")(t) for q in ("qx", "qy", "qz", "qw")], "pose-not-unit",
          line=101),
    Fault("stamps in microseconds", lambda t: t.write(go.timed(t.good, t.good.times * 1e6)),
          "log-long"),
    Fault("stamps in nanoseconds", lambda t: t.write(go.timed(t.good, t.good.times * 1e9)),
          "log-long"),
    Fault("a stamp a year ahead", _one_late, "log-long"),
    Fault("time stands still", edit("t", "65575.5", 2, 680), "log-short"),
    Fault("time runs back", lines(lambda all: [all[0], *all[-2:0:-1], ""]), "time-backwards",
          line=3),
    Fault("cut", lambda t: t.log.write_text(t.log.read_text()[:-90]), "log-truncated", line=680),
    Fault("a line cut", lines(lambda all: [*all[:99], all[99][:20], *all[100:]]), "log-damaged",
          line=100),
    Fault("no header", lines(lambda all: all[1:]), "log-columns", line=1),
    Fault("other columns", lines(lambda all: [all[0].replace("qw", "w"), *all[1:]]), "log-columns",
          line=1),
    Fault("x and qx swapped", _swap_x_qx, "pose-not-unit", line=2),
    Fault("empty log", lambda t: t.log.write_text(""), "log-columns", line=1),
    Fault("only a header", lines(lambda all: [all[0], ""]), "log-short"),
    Fault("half a second", lines(lambda all: [*all[:31], ""]), "log-short"),
    Fault("binary", lambda t: t.log.write_bytes(bytes(range(256)) * 50), "log-columns", line=1),
    Fault("log of another app", _as_other_app, "log-columns", line=1),
    Fault("two sessions", _two_sessions, "session-ambiguous"),
    Fault("two apps", lambda t: write_session(ios_logger, t.good, t.session), "session-ambiguous"),
    Fault("empty folder", _emptied, "session-unknown"),
    Fault("left-handed rotations", _left_handed, "pose-not-rigid"),
    Fault("IMU cut", lambda t: (t.session / "imu.csv").write_text(
        (t.session / "imu.csv").read_text()[:-30]), "log-truncated"),
    Fault("IMU without gyroscope columns", lambda t: (t.session / "imu.csv").write_text(
        "timestamp, a_x, a_y, a_z\n1, 0, 0, 1\n"), "log-columns"),
    Fault("video damaged", lambda t: (t.session / "rgb.mp4").write_bytes(b"no video"), "video",
          "warn"),
    Fault("video shorter", lambda t: _video(t, 500), "video", "warn"),
    Fault("focal length zero", lambda t: lines(lambda all: [
        line.replace(line.split(", ")[9], "0.0") if 0 < k < len(all) - 1 else line
        for k, line in enumerate(all)])(t), "intrinsics", "warn"),
    Fault("mount missing", lambda t: t.mount.unlink(), "mount-missing"),
    Fault("mount is no JSON", lambda t: t.mount.write_text("{"), "mount-unreadable"),
    Fault("mount of three rows", mount(lambda T: T[:3]), "mount-unreadable"),
    Fault("mount with NaN", lambda t: t.mount.write_text(json.dumps(
        {"T_phone_object": [[float("nan")] * 4] * 4})), "mount-not-finite"),
    Fault("mount in mm", mount(offset(1000)), "mount-units"),
    Fault("mount in cm", mount(offset(100)), "mount-units"),
    Fault("mount in inches", mount(offset(1 / 0.0254)), "mount-units"),
    Fault("mount scaled", mount(lambda T: T * [[2, 2, 2, 1]]), "mount-not-rigid"),
    Fault("mount mirrored", mount(lambda T: T * [[-1, 1, 1, 1]]), "mount-not-rigid"),
    Fault("mount column by column", mount(lambda T: T.T), "mount-not-rigid"),
    Fault("mount inverse", _inverse_mount, "standing", "bad"),
    Fault("mount turned", mount(_turned_mount), "standing", "bad"),
    Fault("mount twenty times too far", mount(offset(20)), "phone on the object", "bad"),
    Fault("mount four times too far", mount(offset(4)), "phone on the object", "bad"),
    Fault("mount inside the object", mount(offset(0.2)), "phone on the object", "bad"),
    Fault("mount badly calibrated", mount(lambda T: T, residuals={"rms_mm": 140.0}), "mount", "bad"),
    Fault("mount so-so", mount(lambda T: T, residuals={"rms_deg": 5.0}), "mount", "warn"),
    Fault("mesh missing", lambda t: t.mesh.unlink(), "mesh-missing"),
    Fault("mesh empty", lambda t: t.mesh.write_text(""), "mesh-empty"),
    Fault("mesh of points", lambda t: t.mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "mesh-empty"),
    Fault("mesh with NaN", lambda t: t.mesh.write_text(
        "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "mesh-not-finite"),
    Fault("mesh in mm", mesh(lambda m: m.apply_scale(1000)), "mesh-units"),
    Fault("mesh in cm", mesh(lambda m: m.apply_scale(100)), "mesh-units"),
    Fault("mesh ten times too large", mesh(lambda m: m.apply_scale(10)), "mesh", "bad"),
    Fault("mesh seven times too large", mesh(lambda m: m.apply_scale(7)), "phone on the object", "bad"),
    Fault("mesh ten times too small", mesh(lambda m: m.apply_scale(0.1)), "mesh", "bad"),
    Fault("mesh lies on its edge", mesh(lambda m: m.apply_transform(
        trimesh.transformations.rotation_matrix(0.6, [1, 0, 0]))), "standing", "bad"),
]  # fmt: skip


@pytest.fixture(scope="module")
def good() -> CaptureSession:
    return go.make_session()


@pytest.fixture
def take(tmp_path: Path, good: CaptureSession) -> Take:
    take = go.make_take(tmp_path, good)
    take.write(good)
    return take


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_named_placed_and_told_how_to_mend(take: Take, fault: Fault):
    fault.corrupt(take)
    if fault.kind == "error":
        with pytest.raises(InputError) as caught:
            take.inspect()
        error = caught.value
        assert error.code == fault.told
        assert str(take.folder) in error.where
        assert error.fix
        if fault.line is not None:
            assert error.where == f"{take.log}:{fault.line}"
        return
    seen = take.inspect()
    found = {check.name: check for check in seen.report.checks if check.severity != "ok"}
    assert found[fault.told].severity == fault.kind
    assert found[fault.told].fix
    if fault.kind == "warn":
        refuse_bad(seen)
        return
    with pytest.raises(InputError) as caught:
        refuse_bad(seen)
    assert caught.value.code == "take-bad"
    assert fault.told in caught.value.what.lower()


def test_the_files_themselves_are_good(take: Take):
    assert take.inspect().verdict == "good"
