"""What the phone logs while it films the chair, is clamped to it, and goes with it for a while."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float64
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline, Slerp

from capture_app.simulator.simulated_phone import (
    BOOT_SECONDS,
    PhoneNoise,
    arkit_from_world,
    disturb,
)
from ingest.formats import scanner_3d
from ingest.session import CaptureSession
from tests.simulator.scan_scene import ScanScene, film, intrinsics, orbit_poses

RATE = 30.0
WIDTH = 640
"""Of the pictures, pixels."""
ORBIT, CLAMPING, STILL, TAKE = 12.0, 3.0, 2.5, 4.0
"""Seconds of filming the chair all around, of clamping, of each rest, and of the take."""
STILLS = ((ORBIT + CLAMPING, ORBIT + CLAMPING + STILL), (21.5, 24.0))
"""Seconds from the start of the log in which the clamped phone rests."""
STEADY = PhoneNoise(drift=0.0)
"""A phone whose world does not drift."""


def scan_log(
    scene: ScanScene,
    *,
    seed: int,
    noise: PhoneNoise = STEADY,
    end: Float64[np.ndarray, "4 4"] | None = None,
) -> tuple[CaptureSession, Float64[np.ndarray, "4 4"]]:
    """The log of one ARKit session: orbit, clamping, rest, a lift and a turn, rest on the mark.

    Args:
        scene: what is filmed.
        seed: of the phone's errors.
        noise: the phone's errors.
        end: T_world_phone of the last rest, as when the phone has slipped or the object is not on
            its mark; the first rest's if not given.

    Returns:
        The log without pictures, and T_arkit_world.
    """
    times = np.arange(int((STILLS[1][1]) * RATE) + 1) / RATE
    T_world_phone = _path(scene, times, scene.T_world_clamped if end is None else end)
    T_arkit_world = arkit_from_world(T_world_phone[0])
    T = disturb(T_arkit_world @ T_world_phone, noise, np.random.default_rng(seed))
    session = CaptureSession(
        app=scanner_3d.NAME,
        source=Path("simulated"),
        times=BOOT_SECONDS + times,
        T_world_phone=T,
        intrinsics=np.tile(intrinsics(WIDTH), (len(times), 1)),
        image_size=(WIDTH, 3 * WIDTH // 4),
    )
    return session, T_arkit_world


def with_pictures(
    session: CaptureSession,
    scene: ScanScene,
    folder: Path,
    at: Sequence[float],
    *,
    end: Float64[np.ndarray, "4 4"] | None = None,
) -> CaptureSession:
    """The log with what the phone films at some seconds from its start, as JPEG files in a folder.

    Args:
        session, scene, end: of `scan_log`.
        folder: made if it is not there.
        at: seconds, each that of a pose.
    """
    folder.mkdir(parents=True, exist_ok=True)
    frames = np.rint(np.asarray(at) * RATE).astype(int)
    seconds = session.times[frames] - session.times[0]
    poses = _path(scene, seconds, scene.T_world_clamped if end is None else end)
    files = tuple(folder / f"{k:05d}.jpg" for k in frames)
    for file, (picture, _) in zip(files, film(scene, poses, WIDTH), strict=True):
        cv2.imwrite(str(file), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    return replace(session, images=files, video_times=session.times[frames])


def _path(
    scene: ScanScene, times: Float64[np.ndarray, " frames"], end: Float64[np.ndarray, "4 4"]
) -> Float64[np.ndarray, "frames 4 4"]:
    """T_world_phone without errors."""
    around, clamped = orbit_poses(scene, 48), scene.T_world_clamped
    lifted = clamped.copy()
    lifted[:3, :3] = Rotation.from_euler("zx", [0.5, 0.35]).as_matrix() @ clamped[:3, :3]
    lifted[:3, 3] += [0.2, 0.3, 0.4]
    knots = np.linspace(0.0, ORBIT, len(around))
    orbiting = np.clip(times, 0.0, ORBIT)
    T = np.tile(np.eye(4), (len(times), 1, 1))
    T[:, :3, 3] = CubicSpline(knots, around[:, :3, 3])(orbiting)
    T[:, :3, :3] = RotationSpline(knots, Rotation.from_matrix(around[:, :3, :3]))(
        orbiting
    ).as_matrix()
    first, last = STILLS
    stations = [around[-1], clamped, clamped, lifted, end, end]
    when = [ORBIT, *first, first[1] + TAKE / 2, *last]
    later = times > ORBIT
    T[later] = _between(np.array(when), np.array(stations), times[later])
    return T


def _between(
    when: Float64[np.ndarray, " stations"],
    T: Float64[np.ndarray, "stations 4 4"],
    times: Float64[np.ndarray, " frames"],
) -> Float64[np.ndarray, "frames 4 4"]:
    """From station to station, standing still at each."""
    out = np.tile(np.eye(4), (len(times), 1, 1))
    leg = np.searchsorted(when, times, "right").clip(1, len(when) - 1) - 1
    part = ((times - when[leg]) / np.diff(when)[leg]).clip(0, 1)
    eased = leg + part**2 * (3 - 2 * part)
    out[:, :3, :3] = Slerp(np.arange(len(T)), Rotation.from_matrix(T[:, :3, :3]))(eased).as_matrix()
    for axis in range(3):
        out[:, axis, 3] = np.interp(eased, np.arange(len(T)), T[:, axis, 3])
    return out
