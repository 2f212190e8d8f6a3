"""Wrong set-ups give no motion: `omocap run` ends with exit code 2, says how to mend it, writes nothing.

Each is made from logs of at least two apps. What no log, mesh or mount can tell is listed in
docs/recording.md.
"""

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from capture_app.cli.app import invoke
from ingest.formats import arkit_data_logger, ios_logger, stray_scanner, tum
from ingest.formats.registry import Format
from ingest.mesh import load_mesh
from ingest.mount import object_id
from ingest.mount_file import load_mount, save_mount
from ingest.session import CaptureSession
from omomo_core.geometry.transforms import inverse
from tests.ingest import good_take as go
from tests.ingest.good_take import Take

WITH_IMU = (stray_scanner, ios_logger)
BARE = (arkit_data_logger, tum)
ANY = (stray_scanner, arkit_data_logger)

Change = Callable[[Take], object]


@dataclass(frozen=True)
class SetUp:
    """A way to get it wrong."""

    name: str
    change: Change
    formats: tuple[Format, ...]


def _log(change: Callable[[CaptureSession], CaptureSession]) -> Callable[[Take, Format], object]:
    return lambda take, format_: take.write(change(take.good), format_)


def _turned(axes: str, degrees) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axes, degrees, degrees=True).as_matrix()
    return T


def _transposed(s: CaptureSession) -> CaptureSession:
    T = s.T_world_phone.copy()
    T[:, :3, :3] = T[:, :3, :3].transpose(0, 2, 1)
    return go.posed(s, T)


def _scaled(factor: float) -> Callable[[CaptureSession], CaptureSession]:
    return lambda s: go.placed(s, lambda p: p * factor)


def _swapped(order: list[int]) -> Callable[[CaptureSession], CaptureSession]:
    return lambda s: go.placed(s, lambda p: p[:, order])


def _paced(factor: float) -> Callable[[CaptureSession], CaptureSession]:
    return lambda s: go.timed(s, s.times[0] * factor + (s.times - s.times[0]) * factor)


LOGS: dict[str, tuple[Callable[[CaptureSession], CaptureSession], tuple[Format, ...]]] = {
    "world z up": (lambda s: go.turned_world(s, "x", 90), (*WITH_IMU, *BARE)),
    "world x up": (lambda s: go.turned_world(s, "z", 90), (*WITH_IMU, *BARE)),
    "world upside down": (lambda s: go.turned_world(s, "z", 180), (*WITH_IMU, *BARE)),
    "world y down, turned": (lambda s: go.turned_world(s, "x", 180), (*WITH_IMU, *BARE)),
    "world tilted by 30 deg": (lambda s: go.turned_world(s, "x", 30), (*WITH_IMU, *BARE)),
    "camera of the portrait image": (lambda s: go.turned_camera(s, "z", 90), WITH_IMU),
    "camera upside down": (lambda s: go.turned_camera(s, "z", 180), WITH_IMU),
    "OpenCV's camera": (lambda s: go.turned_camera(s, "x", 180), WITH_IMU),
    "camera tilted by 40 deg": (lambda s: go.turned_camera(s, "y", 40), (*WITH_IMU, *BARE)),
    "poses from world to camera": (
        lambda s: go.posed(s, inverse(s.T_world_phone)),
        (*WITH_IMU, *BARE),
    ),
    "rotations transposed": (_transposed, (*WITH_IMU, *BARE)),
    "quaternions w first": (lambda s: go.order_of_quaternions(s, [3, 0, 1, 2]), WITH_IMU),
    "quaternions w read last": (lambda s: go.order_of_quaternions(s, [1, 2, 3, 0]), WITH_IMU),
    "quaternions x and y swapped": (lambda s: go.order_of_quaternions(s, [1, 0, 2, 3]), WITH_IMU),
    "quaternions conjugated": (
        lambda s: go.order_of_quaternions(s, [0, 1, 2, 3], (-1, -1, -1, 1)),
        WITH_IMU,
    ),
    "positions in cm": (_scaled(100), (*WITH_IMU, *BARE)),
    "positions in mm": (_scaled(1000), (*WITH_IMU, *BARE)),
    "positions in inches": (_scaled(1 / 0.0254), (*WITH_IMU, *BARE)),
    "positions in feet": (_scaled(1 / 0.3048), WITH_IMU),
    "positions at a third": (_scaled(1 / 3), WITH_IMU),
    "positions y and z swapped": (_swapped([0, 2, 1]), (*WITH_IMU, *BARE)),
    "positions x and y swapped": (_swapped([1, 0, 2]), WITH_IMU),
    "positions mirrored": (lambda s: go.placed(s, lambda p: p * [-1, 1, 1]), WITH_IMU),
    "mirrored in x": (lambda s: go.mirrored(s, 0), WITH_IMU),
    "mirrored in y": (lambda s: go.mirrored(s, 1), (*WITH_IMU, *BARE)),
    "mirrored in z": (lambda s: go.mirrored(s, 2), WITH_IMU),
    "stamps in ms": (_paced(1e3), (*WITH_IMU, arkit_data_logger)),
    "stamps in us": (_paced(1e6), (*WITH_IMU, arkit_data_logger)),
    "stamps in ns": (_paced(1e9), (stray_scanner, arkit_data_logger)),
    "stamps that count": (lambda s: go.timed(s, np.arange(len(s.times)) * 1.0), (*WITH_IMU, *BARE)),
    "four times as fast": (_paced(0.25), (*WITH_IMU, *BARE)),
    "twice as slow as its IMU": (
        lambda s: go.timed(s, s.times[0] + (s.times - s.times[0]) * 2),
        WITH_IMU,
    ),
    "ten poses a second": (lambda s: go.at_rate(go.without_imu(s), 9.0), ANY),
    "never at rest": (lambda s: go.kept(go.without_imu(s), slice(120, 540)), (*WITH_IMU, *BARE)),
    "ends before it is put down": (lambda s: go.kept(go.without_imu(s), slice(110, 400)), ANY),
    "tracking lost every second": (
        lambda s: go.jumped(
            go.jumped(
                go.jumped(
                    go.jumped(go.jumped(s, (0.4, 0, 0), at=110), (0.4, 0, 0), at=220),
                    (0.4, 0, 0),
                    at=330,
                ),
                (0.4, 0, 0),
                at=440,
            ),
            (0.4, 0, 0),
            at=550,
        ),
        ANY,
    ),
    "IMU of another take": (
        lambda s: go.with_imu(
            s, accel=s.imu.accel[::-1].copy(), gyro=np.roll(s.imu.gyro, 417, 0)[:, ::-1]
        ),
        WITH_IMU,
    ),
    "accelerometer without gravity": (
        lambda s: go.with_imu(s, accel=s.imu.accel - np.median(s.imu.accel, axis=0)),
        WITH_IMU,
    ),
}


def _mesh(change: Callable[[trimesh.Trimesh], object]) -> Change:
    def apply(take: Take) -> None:
        mesh = trimesh.load_mesh(take.mesh)
        change(mesh)
        mesh.export(take.mesh)

    return apply


def _mount(change: Callable[[np.ndarray], np.ndarray]) -> Change:
    def apply(take: Take) -> None:
        T = change(load_mount(take.mount).T_phone_object.copy())
        take.mount.write_text(json.dumps({"T_phone_object": T.tolist(), "method": "by hand"}))

    return apply


def _moved(metres: float) -> Callable[[np.ndarray], np.ndarray]:
    def change(T: np.ndarray) -> np.ndarray:
        T[:3, 3] += T[:3, :3] @ [0, 0, metres]
        return T

    return change


def _of_another_mesh(take: Take) -> None:
    """Calibrated mounts know their object."""
    save_mount(
        replace(load_mount(take.mount), object_id=object_id(load_mesh(take.mesh))), take.mount
    )
    trimesh.creation.box((0.4, 0.4, 0.9)).export(take.mesh)


def _swap_files(one: str, other: str) -> Change:
    def apply(take: Take) -> None:
        a, b = getattr(take, one), getattr(take, other)
        kept = a.read_bytes()
        shutil.copy(b, a)
        b.write_bytes(kept)

    return apply


FILES: dict[str, Change] = {
    "mesh in mm": _mesh(lambda m: m.apply_scale(1000)),
    "mesh in cm": _mesh(lambda m: m.apply_scale(100)),
    "mesh in inches": _mesh(lambda m: m.apply_scale(1 / 0.0254)),
    "mesh ten times too large": _mesh(lambda m: m.apply_scale(10)),
    "mesh in feet": _mesh(lambda m: m.apply_scale(1 / 0.3048)),
    "mesh ten times too small": _mesh(lambda m: m.apply_scale(0.1)),
    "mesh in km": _mesh(lambda m: m.apply_scale(0.001)),
    "mesh on its edge": _mesh(lambda m: m.apply_transform(_turned("x", 40))),
    "mesh far beside": _mesh(lambda m: m.apply_translation((0, 1.2, 0))),
    "mesh without triangles": lambda t: t.mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n"),
    "mesh and mount swapped": _swap_files("mesh", "mount"),
    "mesh of another object": _of_another_mesh,
    "mount inverse": _mount(lambda T: inverse(T @ _turned("zx", (90, 40)))),
    "mount of another clamping": _mount(lambda T: T @ _turned("xy", (30, 20))),
    "mount in mm": _mount(lambda T: np.block([[T[:3, :3], 1000 * T[:3, 3:]], [T[3:]]])),
    "mount in cm": _mount(lambda T: np.block([[T[:3, :3], 100 * T[:3, 3:]], [T[3:]]])),
    "mount in inches": _mount(lambda T: np.block([[T[:3, :3], T[:3, 3:] / 0.0254], [T[3:]]])),
    "mount a metre off": _mount(_moved(1.0)),
    "mount inside the object": _mount(lambda T: np.block([[T[:3, :3], 0.2 * T[:3, 3:]], [T[3:]]])),
    "mount scaled": _mount(lambda T: T * [[2, 2, 2, 1]]),
    "mount mirrored": _mount(lambda T: T * [[-1, 1, 1, 1]]),
    "mount column by column": _mount(lambda T: T.T),
    "mount identity": _mount(lambda T: np.eye(4)),
    "mount without rows": lambda t: t.mount.write_text('{"T_phone_object": []}'),
    "mount is the session": lambda t: t.mount.write_text("1,2,3"),
}


def _argue(take: Take) -> list[str]:
    return [
        *("run", str(take.session), "--object", str(take.mesh), "--mount", str(take.mount)),
        *("-o", str(take.folder / "out"), "--samples", "1", "--steps", "1", "--no-video"),
    ]


ARGUMENTS: dict[str, Callable[[list[str], Take], list[str]]] = {
    "no mount": lambda a, t: [*a[:4], *a[6:]],
    "no object": lambda a, t: [*a[:2], *a[4:]],
    "identity instead of the mount": lambda a, t: [*a[:5], "identity", *a[6:]],
    "object and session swapped": lambda a, t: [a[0], str(t.mesh), "--object", a[1], *a[4:]],
    "a floor above the object": lambda a, t: [*a, "--floor", "0.4"],
    "a floor three metres off": lambda a, t: [*a, "--floor", "-3.5"],
    "up sideways": lambda a, t: [*a, "--up", "1,0,0"],
    "up down": lambda a, t: [*a, "--up", "0,-1,0"],
    "mesh scale of cm for metres": lambda a, t: [*a, "--mesh-scale", "0.01"],
    "a segment that is not there": lambda a, t: [*a, "--segment", "3"],
    "a format that it is not": lambda a, t: [*a, "--format", "Polycam"],
    "--closure of a box put elsewhere": lambda a, t: [*a, "--closure"],
}


@pytest.fixture(scope="module")
def good() -> CaptureSession:
    return go.make_session()


@pytest.fixture
def take(tmp_path: Path, good: CaptureSession) -> Take:
    return go.make_take(tmp_path, good)


def _refused(arguments: list[str], take: Take, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(take.folder.iterdir())
    code = invoke(arguments)
    told = capsys.readouterr().err
    assert code == 2, told
    assert "fix:" in told
    assert "code:" in told
    assert sorted(take.folder.iterdir()) == before


@pytest.mark.parametrize(
    ("name", "format_"),
    [pytest.param(name, f, id=f"{name}, {f.NAME}") for name, (_, fs) in LOGS.items() for f in fs],
)
def test_a_wrong_log(take: Take, capsys, name: str, format_: Format):
    session = LOGS[name][0](take.good)
    take.write(session if format_ in WITH_IMU else go.without_imu(session), format_)
    _refused(_argue(take), take, capsys)


@pytest.mark.parametrize("format_", [stray_scanner, arkit_data_logger], ids=lambda f: f.NAME)
@pytest.mark.parametrize("name", FILES)
def test_a_wrong_mesh_or_mount(take: Take, capsys, name: str, format_: Format):
    take.write(take.good if format_ in WITH_IMU else go.without_imu(take.good), format_)
    FILES[name](take)
    _refused(_argue(take), take, capsys)


@pytest.mark.parametrize("format_", [stray_scanner, arkit_data_logger], ids=lambda f: f.NAME)
@pytest.mark.parametrize("name", ARGUMENTS)
def test_wrong_arguments(take: Take, capsys, name: str, format_: Format):
    take.write(take.good if format_ in WITH_IMU else go.without_imu(take.good), format_)
    _refused(ARGUMENTS[name](_argue(take), take), take, capsys)


def test_there_are_as_many_as_promised():
    names = [*LOGS, *FILES, *ARGUMENTS]
    assert len(names) == len(set(names)) >= 70
    assert all(len(formats) >= 2 for _, formats in LOGS.values())
