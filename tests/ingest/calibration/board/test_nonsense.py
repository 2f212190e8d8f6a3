"""Corners that no board ever showed must not stop the others from being solved."""

import numpy as np

from ingest.calibration.board.board_poses import board_poses
from ingest.calibration.board.board_spec import Board

BOARD = Board(5, 7, 0.035, 0.026)
K = np.array([[1000.0, 0, 640], [0, 1000, 360], [0, 0, 1]])


def test_frames_of_nonsense_are_left_out():
    numbers = np.arange(len(BOARD.corners))
    seen = (BOARD.corners + np.array([-0.08, -0.12, 0.6])) @ K.T
    good = seen[:, :2] / seen[:, 2:]
    tilted = BOARD.corners @ np.array([[0.8, 0, -0.6], [0, 1, 0], [0.6, 0, 0.8]]).T
    seen = (tilted + np.array([-0.08, -0.12, 0.7])) @ K.T
    also = seen[:, :2] / seen[:, 2:]
    one_point = np.full_like(good, 300.0)
    line = np.stack([np.linspace(0, 1000, len(good)), np.full(len(good), 40.0)], axis=1)
    frames = [good, one_point, also, line]
    found = board_poses(frames, [numbers] * 4, BOARD, K, np.zeros(5))
    assert {0, 2} <= set(found.frames.tolist())
    of_good = found.T_camera_board[list(found.frames).index(0)]
    np.testing.assert_allclose(of_good[:3, 3], [-0.08, -0.12, 0.6], atol=1e-3)
    assert np.isfinite(found.covariance).all()
