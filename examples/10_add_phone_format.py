"""Read the log of an app that is not built in: a small parser, registered, and a take run with it.

Usage: python examples/10_add_phone_format.py [OUTPUT]

The app of this example writes poses.csv: seconds, the camera's position in metres, its rotation vector in
radians, in ARKit's axes (world y up; camera x right, y up, z to the viewer). Writes OUTPUT/my_app and the
result folder OUTPUT/from_my_app (in example_output).
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app import CaptureSession, RunRequest, read_session, register_format, run_take
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from ingest.formats.camera_poses import check_poses

HEADER = "seconds,x,y,z,rx,ry,rz"


class MyApp:
    """All that a format needs; ingest/formats has one module of this kind for each app."""

    NAME = "My App"
    FILES = "a folder with poses.csv"
    LACKS = "no tracking state, intrinsics, video or IMU"

    def detect(self, path: Path) -> bool:
        """Whether the folder is of this app: a cheap look that accepts anything."""
        log = path / "poses.csv"
        return log.is_file() and log.read_bytes()[:99].startswith(HEADER.encode())

    def read(self, path: Path) -> CaptureSession:
        """The poses; `check_poses` refuses, naming the line, what cannot be a phone's track."""
        log = path / "poses.csv"
        rows = np.loadtxt(log, delimiter=",", skiprows=1, ndmin=2)
        T = np.tile(np.eye(4), (len(rows), 1, 1))
        T[:, :3, :3] = Rotation.from_rotvec(rows[:, 4:7]).as_matrix()
        T[:, :3, 3] = rows[:, 1:4]
        check_poses(rows[:, 0], T, log, lambda row: f"{log}, line {row + 2}")
        return CaptureSession(app=self.NAME, source=path, times=rows[:, 0], T_world_phone=T)

    def write(self, session: CaptureSession, folder: Path) -> Path:
        """A session as the app would write it, for tests."""
        folder.mkdir(parents=True, exist_ok=True)
        T, turns = session.T_world_phone, Rotation.from_matrix(session.T_world_phone[:, :3, :3])
        rows = np.column_stack([session.times, T[:, :3, 3], turns.as_rotvec()])
        np.savetxt(folder / "poses.csv", rows, "%.9f", delimiter=",", header=HEADER, comments="")
        return folder


out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
log = MyApp().write(read_session(DEMO / SESSION), out / "my_app")

register_format(MyApp())
session = read_session(log)
print(f"{session.app}: {len(session.times)} poses")
result = out / "from_my_app"
take = RunRequest(
    session=log,
    object=DEMO / MESH,
    mount=DEMO / MOUNT,
    output=result,
    video_size=None,
    replace=True,
)
print(f"The person of this take: {run_take(take).best.joints.shape} joints (frames, 24, xyz)")
