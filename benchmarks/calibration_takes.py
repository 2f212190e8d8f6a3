"""Simulated calibrations by a board: a phone on a box that someone turns, a camera on a tripod."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app.simulator.noise import PhoneNoise
from capture_app.simulator.phone import BOOT_SECONDS, simulate
from capture_app.simulator.wiggle import Wiggle, wiggle_motion
from ingest.calibration.board.poses import board_poses
from ingest.calibration.board.sheet import preset_for
from ingest.calibration.hand_eye.streams import PoseStream
from ingest.mount import Mount
from tests.simulator.witness import board_on_box, corner_observations, tripod

BOARD = preset_for("A4")


@dataclass(frozen=True)
class BoardTake:
    """What the phone and the board's tracker give, and the truth."""

    phone: PoseStream
    target: PoseStream
    T_phone_board: np.ndarray
    offset: float
    """Seconds to add to the target's times."""
    noise_px: float
    wild: float


def board_take(seed: int, kind: Wiggle = "all axes", seconds: float = 20.0) -> BoardTake:
    """One take with everything drawn at random: mount, motion, 0-3 px, drift, outliers, offset."""
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.uniform(-0.4, 0.4, 3)
    noise_px, wild = rng.uniform(0, 3), rng.uniform(0, 0.3)
    motion = wiggle_motion(kind, seconds=seconds, seed=seed)
    session = simulate(
        motion, Mount(T, "truth"), seed=seed, noise=PhoneNoise(drift=rng.uniform(0, 0.01))
    )
    start, error = rng.uniform(0, 1.0), rng.uniform(-0.2, 0.2)
    at = motion.T_world_object[:, :3, 3].mean(axis=0)
    witness = tripod(at, rate=15.0, start=start, distance=rng.uniform(0.9, 1.6))
    T_object_board = board_on_box(BOARD)
    seen = witness.board_poses(motion, T_object_board)
    # In an outlier the detector sees the board of another moment.
    shuffled = np.where(rng.random(len(seen)) < wild, rng.permutation(len(seen)), range(len(seen)))
    pixels, numbers = corner_observations(
        seen[shuffled], BOARD, witness.camera, rng, sigma=noise_px, lost=0.1, wild=0.02
    )
    poses = board_poses(pixels, numbers, BOARD, witness.camera.K, witness.camera.lens)
    sure = ~poses.ambiguous
    times = witness.times(motion)[poses.frames[sure]]
    return BoardTake(
        phone=PoseStream(session.times + error, session.T_world_phone),
        target=PoseStream(times, poses.T_camera_board[sure], poses.covariance[sure]),
        T_phone_board=T @ T_object_board,
        offset=BOOT_SECONDS + start + error,
        noise_px=noise_px,
        wild=wild,
    )
