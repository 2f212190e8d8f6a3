"""Recording the demonstration take with the simulated phone: everything a user would bring."""

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import UInt8
from scipy.spatial.transform import Rotation, Slerp

from capture_app.simulator.carried_box import box_mesh, carried_box, clamped_phone
from capture_app.simulator.noise import PhoneNoise
from capture_app.simulator.phone import simulate
from capture_app.simulator.recording import write_recording
from ingest.mount_file import save_mount
from ingest.session import CaptureSession
from omomo_core.motion import FPS, ObjectMotion
from render import phone_view

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
    save_mount(mount, folder / MOUNT)


def _film(
    motion: ObjectMotion,
    session: CaptureSession,
    seed: int,
    progress: Callable[[str, float], None],
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """What the phone sees at each logged pose, at a fraction of its resolution."""
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
