"""How long a log takes to read, to clean and to inspect, and in how much memory.

Usage: python benchmarks/ingest_speed.py [minutes ...]

Sessions of 1, 5 and 10 minutes at 60 poses and 100 inertial samples a second, as three apps write them.
Every case runs in a process of its own on one core, one after the other; memory is the peak of that
process, less what it needs for its imports.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

# The folder of this file comes first in Python's path, where its name hides the package `ingest`.
sys.path[0] = str(Path(__file__).parents[1])

RATE, IMU_RATE = 60, 100


def made_up(minutes: float):
    """A phone that wanders with ARKit's noise, at rest at both ends, with its accelerometer."""
    from ingest.session import GRAVITY, R_CAMERA_DEVICE, CaptureSession, ImuLog

    seconds, rng = 60 * minutes, np.random.default_rng(0)
    clock = np.arange(int(seconds * RATE)) / RATE
    hold = np.clip(np.minimum(clock - 1, seconds - 1 - clock), 0, 1)[:, None] ** 2
    waves = np.sin(np.outer(clock, [0.31, 0.7, 1.9, 3.1])) @ rng.uniform(-0.2, 0.2, (4, 6))
    T = np.tile(np.eye(4), (len(clock), 1, 1))
    T[:, :3, 3] = hold * waves[:, :3] + rng.normal(scale=1e-4, size=(len(clock), 3))
    turn = Rotation.from_rotvec(hold * waves[:, 3:] + rng.normal(scale=1e-4, size=(len(clock), 3)))
    T[:, :3, :3] = turn.as_matrix()
    times = 65575.5 + clock
    imu_times = 65575.5 + np.arange(int(seconds * IMU_RATE)) / IMU_RATE
    nearest = np.minimum((np.arange(len(imu_times)) * RATE) // IMU_RATE, len(clock) - 1)
    accel = turn[nearest].inv().apply([0, -GRAVITY, 0]) @ R_CAMERA_DEVICE
    accel += rng.normal(scale=0.3, size=accel.shape)
    return CaptureSession(
        app="made up",
        source=Path("made up"),
        times=times,
        T_world_phone=T,
        intrinsics=np.array([1460.0, 1460, 960, 720]) + rng.uniform(-9, 9, (len(times), 4)),
        image_size=(1920, 1440),
        video_times=times,
        imu=ImuLog(imu_times, accel, rng.normal(size=accel.shape)),
    )


def measure(folder: Path) -> dict[str, float]:
    """Processor seconds of each part (others may use the cores too), megabytes of all."""
    import trimesh

    from ingest.formats.registry import read_session
    from ingest.mount import identity_mount
    from ingest.report.take_inspection import inspect_session
    from ingest.trajectory.object_motion import to_object_motion
    from omomo_core.motion import ObjectMesh

    ball = trimesh.creation.icosphere(4, 0.2)
    mesh = ObjectMesh(np.asarray(ball.vertices), np.asarray(ball.faces), "ball")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    clock = [time.process_time()]
    session = read_session(folder)
    clock.append(time.process_time())
    take = to_object_motion(session, mesh, identity_mount())
    clock.append(time.process_time())
    inspect_session(session, take=take)
    clock.append(time.process_time())
    parts = dict(zip(("read", "clean", "report"), np.diff(clock).tolist(), strict=True))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return {**parts, "megabytes": (peak - before) / 1024}


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
        print(json.dumps(measure(Path(sys.argv[2]))))
        return
    from ingest.formats import ios_logger, scan_capture, stray_scanner
    from tests.log_writers import write_session

    print(f"{'app':16}{'minutes':>8}{'read':>8}{'clean':>8}{'report':>8}{'total s':>9}{'MB':>6}")
    for minutes in map(float, sys.argv[1:] or ["1", "5", "10"]):
        session = made_up(minutes)
        for app in (stray_scanner, ios_logger, scan_capture):
            with tempfile.TemporaryDirectory() as folder:
                write_session(app, replace(session, app=app.NAME), Path(folder))
                command = [sys.executable, __file__, "--one", folder]
                found = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
            parts = [found[name] for name in ("read", "clean", "report")]
            row = "".join(f"{part:8.2f}" for part in parts)
            print(f"{app.NAME:16}{minutes:8g}{row}{sum(parts):9.2f}{found['megabytes']:6.0f}")


if __name__ == "__main__":
    main()
