"""A good take of a carried box, and the ways in which its session can go wrong."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation, Slerp

from capture_app.inspection import Inspection, inspect_take
from capture_app.simulator.demo_take import box_mesh, carried_box, clamped_phone
from capture_app.simulator.simulated_phone import simulate
from ingest.formats import stray_scanner
from ingest.mount_file import save_mount
from ingest.session import CaptureSession
from ingest.trajectory.trajectory_config import Reading
from tests.log_writers import write_session

AT = 350
"""A pose in the middle of the carry."""


@dataclass(frozen=True)
class Take:
    """The files of one take."""

    folder: Path
    good: CaptureSession

    @property
    def session(self) -> Path:
        return self.folder / "session"

    @property
    def log(self) -> Path:
        return self.session / "odometry.csv"

    @property
    def mesh(self) -> Path:
        return self.folder / "box.obj"

    @property
    def mount(self) -> Path:
        return self.folder / "mount.json"

    def write(self, session: CaptureSession, format_=stray_scanner) -> None:
        write_session(format_, session, self.session)

    def inspect(self, floor: float | None = None) -> Inspection:
        return inspect_take(self.session, self.mesh, self.mount, reading=Reading(floor=floor))


def make_session() -> CaptureSession:
    """Rest, lift, carry along a bend, put down, rest: 11.6 s at 60 poses a second, with an IMU."""
    return simulate(carried_box(), clamped_phone(), seed=0)


def make_take(folder: Path, good: CaptureSession) -> Take:
    take = Take(folder, good)
    mesh = box_mesh()
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(take.mesh)
    save_mount(clamped_phone(), take.mount)
    return take


def posed(s: CaptureSession, T: np.ndarray) -> CaptureSession:
    return replace(s, T_world_phone=T)


def timed(s: CaptureSession, times: np.ndarray) -> CaptureSession:
    return replace(s, times=times, video_times=times)


def kept(s: CaptureSession, keep) -> CaptureSession:
    """Only some of its poses, by a slice, mask or list."""
    assert s.intrinsics is not None
    times = s.times[keep]
    return replace(
        s,
        times=times,
        video_times=times,
        T_world_phone=s.T_world_phone[keep],
        intrinsics=s.intrinsics[keep],
    )


def without_imu(s: CaptureSession) -> CaptureSession:
    return replace(s, imu=None)


def placed(s: CaptureSession, change) -> CaptureSession:
    """With other positions."""
    T = s.T_world_phone.copy()
    T[:, :3, 3] = change(T[:, :3, 3])
    return posed(s, T)


def noisy(s: CaptureSession, metres: float, degrees: float) -> CaptureSession:
    """With white noise on each axis of each pose."""
    rng, T = np.random.default_rng(0), s.T_world_phone.copy()
    T[:, :3, 3] += rng.normal(scale=metres, size=(len(T), 3))
    turns = rng.normal(scale=np.radians(degrees), size=(len(T), 3))
    T[:, :3, :3] = T[:, :3, :3] @ Rotation.from_rotvec(turns).as_matrix()
    return posed(without_imu(s), T)


def turned_world(s: CaptureSession, axes: str, degrees) -> CaptureSession:
    """The same poses in a world that is turned."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axes, degrees, degrees=True).as_matrix()
    return posed(s, T @ s.T_world_phone)


def turned_camera(s: CaptureSession, axes: str, degrees) -> CaptureSession:
    """The same poses of a camera whose axes are turned."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler(axes, degrees, degrees=True).as_matrix()
    return posed(s, s.T_world_phone @ T)


def mirrored(s: CaptureSession, axis: int) -> CaptureSession:
    """Positions and rotations seen in a mirror: each rotation is a rotation still."""
    M = np.eye(4)
    M[axis, axis] = -1
    return posed(s, M @ s.T_world_phone @ M)


def jumped(s: CaptureSession, metres=(0.0, 0, 0), degrees=(0.0, 0, 0), at=AT) -> CaptureSession:
    """A relocalisation: everything from one pose on is moved, turned about where it happens."""
    T, pivot = s.T_world_phone.copy(), s.T_world_phone[at, :3, 3]
    R = Rotation.from_euler("xyz", degrees, degrees=True)
    T[at:, :3, 3] = R.apply(T[at:, :3, 3] - pivot) + pivot + metres
    T[at:, :3, :3] = R.as_matrix() @ T[at:, :3, :3]
    return posed(s, T)


def held(s: CaptureSession, first: int, last: int, pose: np.ndarray | None = None):
    """The same pose over and over: its own first one, or another."""
    T = s.T_world_phone.copy()
    T[first:last] = T[first if first else last - 1] if pose is None else pose
    return posed(s, T)


def at_rate(s: CaptureSession, rate: float) -> CaptureSession:
    """Logged at another rate."""
    times = np.arange(s.times[0], s.times[-1], 1 / rate)
    R = Slerp(s.times, Rotation.from_matrix(s.T_world_phone[:, :3, :3]))(times)
    T = np.tile(np.eye(4), (len(times), 1, 1))
    T[:, :3, :3] = R.as_matrix()
    for axis in range(3):
        T[:, axis, 3] = np.interp(times, s.times, s.T_world_phone[:, axis, 3])
    K = np.tile([1460.0, 1460, 960, 720], (len(times), 1))
    return replace(s, times=times, video_times=times, T_world_phone=T, intrinsics=K)


def order_of_quaternions(s: CaptureSession, order: list[int], signs=(1, 1, 1, 1)) -> CaptureSession:
    """Stray Scanner's quaternion columns filled in another order."""
    flip = np.diag([1.0, -1.0, -1.0])
    xyzw = Rotation.from_matrix(s.T_world_phone[:, :3, :3] @ flip).as_quat()
    T = s.T_world_phone.copy()
    T[:, :3, :3] = Rotation.from_quat(xyzw[:, order] * signs).as_matrix() @ flip
    return posed(s, T)


def with_imu(s: CaptureSession, **changes) -> CaptureSession:
    assert s.imu is not None
    return replace(s, imu=replace(s.imu, **changes))


def slipped(s: CaptureSession, degrees: float, metres: float) -> CaptureSession:
    """The clamp gives way within half a second in mid-air: the phone turns and slides on the box."""
    part = np.clip((np.arange(len(s.times)) - AT) / 30, 0, 1)[:, None]
    T = np.tile(np.eye(4), (len(part), 1, 1))
    T[:, :3, :3] = Rotation.from_rotvec(part * [0, 0, np.radians(degrees)]).as_matrix()
    T[:, :3, 3] = part * [metres, 0, 0]
    return without_imu(posed(s, s.T_world_phone @ T))


def shaken(s: CaptureSession, metres: float, hertz: float, degrees: float = 0.0) -> CaptureSession:
    """Shaken sideways, or about its axis, in mid-air."""
    clock = s.times - s.times[0]
    wave = np.sin(2 * np.pi * hertz * clock) * ((clock > 3.5) & (clock < 8))
    T = s.T_world_phone.copy()
    T[:, 0, 3] += metres * wave
    turn = Rotation.from_rotvec(np.outer(np.radians(degrees) * wave, [0, 1, 0])).as_matrix()
    T[:, :3, :3] = turn @ T[:, :3, :3]
    return without_imu(posed(s, T))
