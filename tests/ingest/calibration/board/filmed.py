"""Pictures of a board made by warping it: quick, and independent of how witnesses are drawn."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from ingest.calibration.board.board_spec import Board, Checkerboard, board_image
from ingest.calibration.board.camera_file import WitnessCamera

SIZE = (800, 600)
CAMERA = WitnessCamera(820.0, 820.0, 395.0, 305.0, size=SIZE)
_PX_PER_MM = 3.0
_BORDER = 40


def poses(count: int, rng: np.random.Generator, *, tilt: float = 50.0) -> np.ndarray:
    """T_camera_board of boards (about A4) before a camera, turned to all sides, well in view."""
    T = np.tile(np.eye(4), (count, 1, 1))
    axis = rng.normal(size=(count, 3)) * [1, 1, 0.2]
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    turn = Rotation.from_rotvec(axis * np.radians(rng.uniform(10, tilt, (count, 1))))
    T[:, :3, :3] = (turn * Rotation.from_euler("z", rng.uniform(-3, 3, (count, 1)))).as_matrix()
    middle = np.stack(
        [rng.uniform(-0.1, 0.1, count), rng.uniform(-0.1, 0.1, count), 0 * T[:, 0, 0]]
    )
    depth = rng.uniform(0.55, 0.8, count)
    centre = (middle.T + np.array([0.0, 0.0, 1.0])) * depth[:, None]
    T[:, :3, 3] = centre - T[:, :3, :3] @ [0.0875, 0.1225, 0]
    return T


def sway(count: int) -> np.ndarray:
    """T_camera_board of a board that swings smoothly."""
    t = np.linspace(0, 2 * np.pi, count)
    turn = np.stack([0.5 * np.sin(t), 0.55 * np.cos(t), 0.3 * np.sin(2 * t)], axis=1)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = Rotation.from_rotvec(turn).as_matrix()
    centre = np.stack([0.05 * np.sin(t), 0.03 * np.cos(t), 0.65 + 0.1 * np.sin(t)], axis=1)
    T[:, :3, 3] = centre - T[:, :3, :3] @ [0.0875, 0.1225, 0]
    return T


def sheet_of(board: Board | Checkerboard, pixels: int, border: int) -> np.ndarray:
    """A board with white around it, its squares so many pixels wide."""
    if isinstance(board, Board):
        width, height = (n * pixels + 2 * border for n in (board.columns, board.rows))
        return board_image(board, width, height, pixels / board.square / 1e3)
    dark = np.add.outer(np.arange(board.rows), np.arange(board.columns)) % 2 == 0
    squares = np.kron(np.where(dark, 0, 255), np.ones((pixels, pixels)))
    return np.pad(squares, border, constant_values=255).astype(np.uint8)


def picture(
    T: np.ndarray, board: Board | Checkerboard, camera: WitnessCamera = CAMERA
) -> np.ndarray:
    """The grey picture of a board on a grey wall, without distortion of the lens."""
    assert camera.size is not None
    sheet = sheet_of(board, round(1e3 * _PX_PER_MM * board.square), _BORDER)
    height, width = sheet.shape
    metres = np.eye(3) / (1e3 * _PX_PER_MM)
    # Texel k has its middle at k + 1/2.
    metres[:2, 2] = np.array([board.width, board.height]) / 2 + (
        0.5 - np.array([width, height]) / 2
    ) / (1e3 * _PX_PER_MM)
    metres[2, 2] = 1
    H = camera.K @ T[:3, [0, 1, 3]] @ metres
    finer = np.array([[2, 0, 0.5], [0, 2, 0.5], [0, 0, 1.0]])
    size = (2 * camera.size[0], 2 * camera.size[1])
    large = cv2.warpPerspective(sheet, finer @ H, size, flags=cv2.INTER_LINEAR, borderValue=120.0)
    return cv2.resize(np.asarray(large, np.uint8), camera.size, interpolation=cv2.INTER_AREA)


def write_film(path: Path, pictures: Sequence[np.ndarray], stamps: Sequence[int]) -> Path:
    """An H.264 video of grey pictures at these milliseconds."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.height, stream.width = pictures[0].shape
        stream.pix_fmt = "yuv420p"
        stream.time_base = stream.codec_context.time_base = Fraction(1, 1000)
        stream.options = {"crf": "14", "preset": "ultrafast"}
        for grey, stamp in zip(pictures, stamps, strict=True):
            frame = av.VideoFrame.from_ndarray(np.repeat(grey[..., None], 3, 2), format="rgb24")
            frame.pts, frame.time_base = stamp, Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path
