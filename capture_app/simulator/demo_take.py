"""The demonstration take: a carried box, recorded by the simulated phone."""

import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from fractions import Fraction
from itertools import chain
from pathlib import Path

import av
import numpy as np
import trimesh
from jaxtyping import Float, UInt8
from scipy.spatial.transform import Rotation, Slerp

from capture_app.simulator.simulated_phone import PhoneNoise, simulate
from ingest.formats import stray_scanner
from ingest.mount import Mount, object_id
from ingest.mount_file import save_mount
from ingest.session import CaptureSession
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion
from render import phone_view

WIDTH, DEPTH, HEIGHT = 0.34, 0.44, 0.30
"""Extents of the box along its x (the way it is carried), y (from hand to hand) and z, metres."""
CARRYING_HEIGHT = 1.02
"""Carrying height of the box's centre, metres."""
PACE = 0.85
"""Walking speed in the middle of the carry, m/s."""
GAIT_HZ = 1.7
"""Steps per second."""
BOB = 0.012
"""How far a carried box goes up and down with each step, metres."""
SWAY = 0.010
"""How far a carried box goes to the sides with each step, metres."""
REST = 1.6
"""Time at rest, before and after, seconds."""
LIFT = 1.5
"""Time of lifting, and of lowering, seconds."""
CARRY = 5.4
"""Time of carrying, seconds."""


def carried_box() -> ObjectMotion:
    """The box's motion: 13 s at 30 fps, resting on the floor at both ends."""
    times = np.arange(int((2 * REST + 2 * LIFT + CARRY) * FPS)) / FPS
    lifted = _smooth((times - REST) / LIFT) - _smooth((times - REST - LIFT - CARRY) / LIFT)
    walked = np.clip((times - REST - LIFT) / CARRY, 0, 1)
    going = np.sin(np.pi * walked) ** 0.7 * (walked > 0) * (walked < 1)
    heading = np.radians(70) * _smooth(walked)
    step = PACE * going[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1) / FPS
    phase = 2 * np.pi * GAIT_HZ * times
    left = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    pose = np.tile(np.eye(4), (len(times), 1, 1))
    pose[:, :2, 3] = np.cumsum(step, axis=0) + (SWAY * going * np.sin(phase / 2))[:, None] * left
    # Lifting brings a load towards the body.
    pose[:, 0, 3] -= 0.10 * _smooth((times - REST) / LIFT)
    pose[:, 2, 3] = (
        HEIGHT / 2 + lifted * (CARRYING_HEIGHT - HEIGHT / 2) + BOB * going * np.sin(phase)
    )
    tilt = 0.12 * np.sin(np.pi * np.clip((times - REST) / LIFT, 0, 1))
    pose[:, :3, :3] = (
        Rotation.from_euler("z", heading[:, None]) * Rotation.from_euler("y", -tilt[:, None])
    ).as_matrix()
    return ObjectMotion(mesh=box_mesh(), T_world_object=pose, valid=np.ones(len(times), bool))


def box_mesh() -> ObjectMesh:
    """The box, its origin in the middle."""
    solid = trimesh.creation.box((WIDTH, DEPTH, HEIGHT)).subdivide().subdivide()
    return ObjectMesh(np.asarray(solid.vertices), np.asarray(solid.faces), "box")


def clamped_phone() -> Mount:
    """A phone on the far side of the box, portrait, looking ahead and a little down, not quite true."""
    R_object_phone: Float[np.ndarray, "3 3"] = np.array(
        [[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]]
    )
    crooked = Rotation.from_euler("xyz", [4.0, -9.0, 6.0], degrees=True).as_matrix()
    T_object_phone = np.eye(4)
    T_object_phone[:3, :3] = R_object_phone @ crooked
    T_object_phone[:3, 3] = [WIDTH / 2 + 0.03, 0.05, 0.06]
    return Mount(T_phone_object=np.linalg.inv(T_object_phone), method="drawing")


def _smooth(x: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    """Minimum-jerk step from 0 at x <= 0 to 1 at x >= 1."""
    x = np.clip(x, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x**2)


VIDEO_RATE = 60


def write_recording(
    session: CaptureSession,
    folder: Path,
    pictures: Iterable[UInt8[np.ndarray, "height width 3"]] | None = None,
) -> Path:
    """Write a session as Stray Scanner does; returns the folder.

    Args:
        session: as `simulate` makes it.
        folder: made if it is not there.
        pictures: one RGB picture per pose, in order, all of one size with even sides; any
            scale of the session's image size. None writes no video.

    Raises:
        ValueError: when there are not as many pictures as poses.
    """
    if pictures is None:
        return stray_scanner.write(session, folder)
    with tempfile.TemporaryDirectory() as temporary:
        video = Path(temporary) / "film.mp4"
        count = _encode(pictures, video)
        if count != len(session.times):
            raise ValueError(f"{count} pictures for {len(session.times)} poses")
        filmed = replace(session, video=video, video_times=session.times)
        return stray_scanner.write(filmed, folder)


def _encode(frames: Iterable[UInt8[np.ndarray, "height width 3"]], path: Path) -> int:
    """H.264 with the app's stamps (frame/60, whatever the real time); returns the frame count."""
    pictures = iter(frames)
    first = next(pictures, None)
    if first is None:
        return 0
    count = 0
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=VIDEO_RATE)
        stream.height, stream.width = first.shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.time_base = Fraction(1, VIDEO_RATE)
        stream.options = {"crf": "20", "preset": "veryfast"}
        for picture in chain([first], pictures):
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
            frame.pts = count
            container.mux(stream.encode(frame))
            count += 1
        container.mux(stream.encode())
    return count


DEMO = Path(__file__).parent.parent / "demo_take"
"""The take that comes with the program, as `record_demo` wrote it."""
SESSION, MESH, MOUNT = "session", "box.obj", "mount.json"
VIDEO_WIDTH, VIDEO_HEIGHT = 320, 240


def record_demo(
    folder: Path,
    *,
    seed: int = 0,
    noise: PhoneNoise | None = None,
    video: bool = True,
    progress: Callable[[str, float], None] = lambda name, done: None,
) -> None:
    """Write a session, the object's mesh and the mount into a folder.

    Args:
        folder: made if it is not there; gets `session/`, `box.obj` and `mount.json`.
        seed: of the phone's errors and of the room it films.
        noise: the phone's errors (default: those of a recent iPhone).
        video: also draw what the phone films.
        progress: called with how far the video is.
    """
    motion, mount = carried_box(), clamped_phone()
    session = simulate(motion, mount, seed=seed, noise=noise)
    pictures = _film(motion, session, seed, progress) if video else None
    folder.mkdir(parents=True, exist_ok=True)
    write_recording(session, folder / SESSION, pictures)
    mesh = box_mesh()
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(folder / MESH)
    # Calibrated mounts say which mesh they belong to, so that another one is refused.
    save_mount(replace(mount, object_id=object_id(mesh)), folder / MOUNT)


def _film(
    motion: ObjectMotion,
    session: CaptureSession,
    seed: int,
    progress: Callable[[str, float], None],
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """Return what the phone sees at each logged pose, at a fraction of its resolution."""
    assert session.intrinsics is not None and session.image_size is not None  # noqa: PT018
    times = session.times - session.times[0]
    T_world_phone = motion.T_world_object @ np.linalg.inv(clamped_phone().T_phone_object)
    known = np.arange(len(T_world_phone)) / FPS
    at = np.clip(times, known[0], known[-1])
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    turning = Slerp(known, Rotation.from_matrix(T_world_phone[:, :3, :3]))
    poses[:, :3, :3] = turning(at).as_matrix()
    poses[:, :3, 3] = np.stack([np.interp(at, known, T_world_phone[:, i, 3]) for i in range(3)], 1)
    shrink = VIDEO_WIDTH / session.image_size[0]
    fx, fy, cx, cy = session.intrinsics.mean(axis=0) * shrink
    pictures = phone_view.frames(
        poses,
        fx=float(fx),
        fy=float(fy),
        cx=float(cx),
        cy=float(cy),
        width=VIDEO_WIDTH,
        height=VIDEO_HEIGHT,
        seed=seed,
    )
    for k, picture in enumerate(pictures):
        yield picture
        progress("film", (k + 1) / len(times))
