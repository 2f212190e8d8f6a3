"""A witness: a second camera on a tripod that films the object with a board on it."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from capture_app.simulator.demo_take import WIDTH
from ingest.calibration.board.board_lens import distorted
from ingest.calibration.board.board_spec import Board, board_image
from ingest.calibration.board.camera_file import WitnessCamera
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMotion
from render.cameras import look_at
from render.props import Actor
from render.scene import Drawable, split_mesh
from render.video import write_video
from tests.simulator.witness_view import frames

_AWAY = 0.002
"""The board's paper before the object's face, metres."""
_BORDER_MM = 8.0
_TEXELS = 4.0
"""Of the board's texture in a millimetre."""
_WILD = 40.0
"""A wrong corner is off by up to so many pixels along each axis."""


@dataclass(frozen=True)
class Witness:
    """Where the second camera stands, what it is, and how its clock runs."""

    camera: WitnessCamera
    """Its `size` is that of its pictures."""
    T_world_camera: Float64[np.ndarray, "4 4"]
    """OpenCV's axes (x right, y down, z ahead), in the world of the motion."""
    rate: float = 30.0
    """Pictures a second."""
    start: float = 0.0
    """Second of the motion at the first picture, where the video's clock shows 0."""

    def times(self, motion: ObjectMotion) -> Float64[np.ndarray, " pictures"]:
        """Seconds on the video's clock of the pictures, from `start` to the end of the motion."""
        last = (len(motion.T_world_object) - 1) / FPS - self.start
        return np.arange(int(last * self.rate + 1e-6) + 1) / self.rate

    def board_poses(
        self, motion: ObjectMotion, T_object_board: Float64[np.ndarray, "4 4"]
    ) -> Float64[np.ndarray, "pictures 4 4"]:
        """T_camera_board at `times`: the truth."""
        T = object_poses(motion, self.times(motion) + self.start)
        return inverse(self.T_world_camera) @ T @ T_object_board


def tripod(
    target: Float64[np.ndarray, "3"] | None = None,
    *,
    distance: float = 1.3,
    size: tuple[int, int] = (1280, 720),
    distortion: tuple[float, ...] = (),
    rate: float = 30.0,
    start: float = 0.0,
) -> Witness:
    """A camera that looks at the box's front from a little above and to the side.

    Args:
        target: what it looks at, world, metres; the middle of a wiggle in the air by default.
        distance: from it, metres.
        size, distortion, rate, start: see `Witness`.
    """
    at = np.array([0.0, 0.0, 0.9]) if target is None else target
    away = np.array([0.92, -0.25, 0.3])
    T = look_at(at + distance * away / np.linalg.norm(away), at) @ T_OPENCV_ARKIT_CAMERA
    focal = 0.95 * size[0]
    camera = WitnessCamera(
        focal, focal, 0.49 * size[0], 0.51 * size[1], distortion, size, source="simulated"
    )
    return Witness(camera, T, rate, start)


def board_on_box(board: Board) -> Float64[np.ndarray, "4 4"]:
    """T_object_board of a board stuck upright, a little crooked, on the face at +x of the box."""
    T = np.eye(4)
    # Seen from +x: the board's x to the right (+y), its y down, its z into the box.
    upright = np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    T[:3, :3] = upright @ Rotation.from_euler("z", 4.0, degrees=True).as_matrix()
    middle = np.array([board.width, board.height, 0]) / 2
    T[:3, 3] = [WIDTH / 2 + _AWAY, 0.02, 0.0] - T[:3, :3] @ middle
    return T


def object_poses(
    motion: ObjectMotion, times: Float64[np.ndarray, " n"]
) -> Float64[np.ndarray, "n 4 4"]:
    """T_world_object at seconds of the motion, smooth between its frames."""
    known = np.arange(len(motion.T_world_object)) / FPS
    T = np.tile(np.eye(4), (len(times), 1, 1))
    turning = RotationSpline(known, Rotation.from_matrix(motion.T_world_object[:, :3, :3]))
    T[:, :3, :3] = turning(times).as_matrix()
    T[:, :3, 3] = CubicSpline(known, motion.T_world_object[:, :3, 3])(times)
    return T


def corner_observations(
    T_camera_board: Float64[np.ndarray, "frames 4 4"],
    board: Board,
    camera: WitnessCamera,
    rng: np.random.Generator,
    *,
    sigma: float = 0.3,
    lost: float = 0.0,
    wild: float = 0.0,
) -> tuple[list[Float64[np.ndarray, "_ 2"]], list[Int[np.ndarray, " _"]]]:
    """What a detector would find, without drawing: pixels and numbers of corners of each frame.

    Corners outside the picture, and boards seen from behind, are not found.

    Args:
        T_camera_board: OpenCV's axes.
        board, camera: what is seen by what.
        rng: draws the errors.
        sigma: of each corner along each axis, pixels.
        lost: part of the corners that are not found.
        wild: part of those found that are somewhere else, up to 40 pixels away.
    """
    points = (
        board.corners @ T_camera_board[:, :3, :3].swapaxes(1, 2) + T_camera_board[:, None, :3, 3]
    )
    ahead = points[..., 2] > 0.05
    flat = (points[..., :2] / np.where(ahead, points[..., 2], 1)[..., None]).reshape(-1, 2)
    bent = distorted(flat, camera.lens) if camera.distortion else flat
    pixels = (bent * [camera.fx, camera.fy] + [camera.cx, camera.cy]).reshape(*ahead.shape, 2)
    pixels += rng.normal(0.0, sigma, pixels.shape)
    off = rng.random(ahead.shape) < wild
    pixels[off] += rng.uniform(-_WILD, _WILD, (int(off.sum()), 2))
    # The board's z goes into the paper: away from a camera before it.
    facing = np.einsum("fi,fi->f", T_camera_board[:, :3, 2], points.mean(axis=1)) > 0
    size = np.array(camera.size if camera.size else (np.inf, np.inf))
    inside = ((pixels > -0.5) & (pixels < size - 0.5)).all(axis=2)
    found = ahead & inside & facing[:, None] & (rng.random(ahead.shape) >= lost)
    return [p[k] for p, k in zip(pixels, found, strict=True)], [np.flatnonzero(k) for k in found]


def film(
    motion: ObjectMotion,
    board: Board,
    T_object_board: Float64[np.ndarray, "4 4"],
    witness: Witness,
    *,
    seed: int = 0,
) -> Iterator[np.ndarray]:
    """The witness's pictures (height, width, 3) at its `times`: the object with the board, in a room."""
    assert witness.camera.size is not None
    T_world_object = object_poses(motion, witness.times(motion) + witness.start)
    shape = split_mesh(motion.mesh.vertices, motion.mesh.faces)
    vertices, faces = shape.vertices, shape.faces
    actors = [
        Actor(Drawable("object", vertices, faces, (0.87, 0.60, 0.33)), T_world=T_world_object),
        Actor(_paper(board), T_world=T_world_object @ T_object_board),
    ]
    camera = witness.camera
    return frames(
        witness.T_world_camera,
        actors,
        len(T_world_object),
        K=camera.K,
        distort=(lambda rays: distorted(rays, camera.lens)) if camera.distortion else None,
        width=witness.camera.size[0],
        height=witness.camera.size[1],
        seed=seed,
    )


def record_witness(
    path: Path,
    motion: ObjectMotion,
    board: Board,
    T_object_board: Float64[np.ndarray, "4 4"],
    witness: Witness,
    *,
    seed: int = 0,
) -> int:
    """Write the witness's H.264 video, and its camera beside it as camera.json.

    Returns:
        The number of pictures.
    """
    save_camera(witness.camera, path.with_name("camera.json"))
    pictures = film(motion, board, T_object_board, witness, seed=seed)
    return write_video(path, pictures, witness.rate, crf=16)


def _paper(board: Board) -> Drawable:
    """The printed sheet: a rectangle with a white border, in the board's frame."""
    width, height = (1e3 * side + 2 * _BORDER_MM for side in (board.width, board.height))
    across, down = round(width * _TEXELS), round(height * _TEXELS)
    picture = board_image(board, across, down, _TEXELS)
    # The texture is a whole number of texels, the sheet is as large as it.
    sheet = np.array([across, down]) / _TEXELS / 1e3
    start = (np.array([board.width, board.height]) - sheet) / 2
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]])
    vertices = np.concatenate([start + corners * sheet, np.zeros((4, 1))], axis=1)
    return Drawable(
        "board",
        vertices,
        np.array([[0, 2, 1], [0, 3, 2]]),
        uv=corners,
        texture=np.repeat(picture[..., None], 3, axis=2),
        casts_shadow=False,
    )


def save_camera(camera: WitnessCamera, path: Path) -> None:
    """Write the JSON that `load_camera` reads."""
    table: dict[str, object] = {name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy")}
    if camera.distortion:
        table["distortion"] = list(camera.distortion)
    if camera.size:
        table["width"], table["height"] = camera.size
    path.write_text(json.dumps(table, indent=2) + "\n", encoding="utf-8")
