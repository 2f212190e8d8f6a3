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
from ingest.formats.text_table import first_row, logs, numbers, only_log, read_rows

HEADER = "seconds,x,y,z,rx,ry,rz"


class MyApp:
    """All that a format needs; ingest/formats has one module of this kind for each app."""

    NAME = "My App"
    FILES = "poses.csv, or a folder with it"
    LACKS = "no tracking state, intrinsics, video or IMU"

    def detect(self, path: Path) -> bool:
        """Whether the file, or a .csv file of the folder, is of this app; a cheap look at anything."""
        return bool(logs(path, ("*.csv",), is_log))

    def read(self, path: Path) -> CaptureSession:
        """Read the poses; `numbers` and `check_poses` refuse, naming the line, what is no track."""
        log = only_log(path, logs(path, ("*.csv",), is_log))
        table = numbers(read_rows(log, ",").without_header(), 7, range(7))
        times, places, turns = np.split(table.values, [1, 4], axis=1)
        T = np.tile(np.eye(4), (len(times), 1, 1))
        T[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
        T[:, :3, 3] = places
        check_poses(times[:, 0], T, log, table.place)
        return CaptureSession(app=self.NAME, source=path, times=times[:, 0], T_world_phone=T)


def is_log(file: Path) -> bool:
    """Whether a file is of this app, by its first line and not by its name."""
    return first_row(file) == HEADER


def write(session: CaptureSession, folder: Path) -> Path:
    """Write a session as the app would; a format that is built in has this in tests/log_writers."""
    folder.mkdir(parents=True, exist_ok=True)
    T, turns = session.T_world_phone, Rotation.from_matrix(session.T_world_phone[:, :3, :3])
    rows = np.column_stack([session.times, T[:, :3, 3], turns.as_rotvec()])
    np.savetxt(folder / "poses.csv", rows, "%.9f", delimiter=",", header=HEADER, comments="")
    return folder


out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
log = write(read_session(DEMO / SESSION), out / "my_app")

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
