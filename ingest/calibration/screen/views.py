"""Pictures that show the phone's screen and the object, read into poses."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float64

from ingest.calibration.board.board_detect import Corners, Detector, Grey
from ingest.calibration.board.board_lens import calibrate_camera
from ingest.calibration.board.board_place import BoardPlace
from ingest.calibration.board.board_poses import BoardPoses, board_poses
from ingest.calibration.board.board_spec import Board, Checkerboard
from ingest.calibration.board.board_track import MAX_PICTURES, MAX_PIXELS
from ingest.calibration.board.camera_file import WitnessCamera
from ingest.calibration.screen.screen import ScreenViews
from ingest.colmap import pycolmap
from ingest.formats.still_images import picture_size
from ingest.uncertainty import of_inverse
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

_SUFFIXES = (".png", ".jpg", ".jpeg")
_MODEL_SIGMA = np.diag([np.radians(0.05) ** 2] * 3 + [0.001**2] * 3)
"""Of a picture's pose in a COLMAP model (rotation, metres); the pictures' scatter corrects it."""
_MESH_SIGMA = np.diag([np.radians(0.2) ** 2] * 3 + [0.001**2] * 3)
"""Of the mesh in the model that it was made from."""
_LENSES = {
    "SIMPLE_PINHOLE": (),
    "PINHOLE": (),
    "SIMPLE_RADIAL": (0,),
    "RADIAL": (0, 1),
    "OPENCV": (0, 1, 2, 3),
    "FULL_OPENCV": (0, 1, 2, 3, 4, 5, 6, 7),
}
"""COLMAP's camera models that are OpenCV's: where each of its coefficients goes."""


class Photo(NamedTuple):
    """One picture of a folder."""

    name: str
    grey: Grey


def photos(folder: Path) -> Iterator[Photo]:
    """The PNG and JPEG files of a folder, by name; as the sensor saw them.

    Raises:
        InputError: "no-pictures", "image-damaged" or "video-bounds".
    """
    files = sorted(f for f in folder.glob("*") if f.suffix.lower() in _SUFFIXES)
    if not files:
        raise InputError(
            "no-pictures",
            "The folder holds no PNG or JPEG pictures.",
            where=str(folder),
            fix="Give the folder with the pictures that show the phone's screen and the object.",
        )
    for file in files:
        size = picture_size(file)
        if len(files) > MAX_PICTURES or (size and size[0] * size[1] > MAX_PIXELS):
            raise InputError(
                "video-bounds", "The pictures are too many, or too large.", where=str(file)
            )
        grey = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if grey is None:
            raise InputError("image-damaged", f"{file.name} is no picture.", where=str(file))
        yield Photo(file.name, np.asarray(grey, np.uint8))


def views_with_board(
    pictures: Iterable[Photo],
    shown: Board,
    fixed: Board | Checkerboard,
    place: BoardPlace,
    camera: WitnessCamera | None = None,
) -> ScreenViews:
    """Where the board on the screen and the board fixed on the object are in each picture.

    Args:
        pictures: of one camera at one zoom.
        shown: the board as it is on the screen.
        fixed: the board on the object.
        place: where that is in the object's frame.
        camera: that took them; calibrated from the fixed board if not given.

    Raises:
        InputError: "camera-size", "screen-unseen", or of `calibrate_camera`.
    """
    on_screen, on_object = Detector(shown), Detector(fixed)
    one: list[Corners] = []
    two: list[Corners] = []
    size = (0, 0)
    for picture in pictures:
        size = picture.grey.shape[1], picture.grey.shape[0]
        camera = camera.at(*size) if camera else None
        one.append(on_screen.find(picture.grey))
        two.append(on_object.find(picture.grey))
    if camera is None:
        camera = calibrate_camera([c.pixels for c in two], [c.numbers for c in two], fixed, size)
    here, there = (_poses(c, b, camera.K, camera.lens) for c, b in ((one, shown), (two, fixed)))
    both = np.intersect1d(_sure(here), _sure(there))
    _check_seen(both, len(one), here, there)
    i, j = (np.searchsorted(p.frames, both) for p in (here, there))
    T_object_board = place.T_object_board
    return ScreenViews(
        here.T_camera_board[i],
        here.covariance[i],
        there.T_camera_board[j],
        there.covariance[j],
        inverse(T_object_board),
        of_inverse(T_object_board, place.covariance),
    )


def views_in_model(
    pictures: Iterable[Photo],
    shown: Board,
    model: Path,
    T_object_model: Float64[np.ndarray, "4 4"] | None = None,
    scale: float = 1.0,
) -> ScreenViews:
    """Where the board on the screen is in each picture of a COLMAP model, and the object by the model.

    Args:
        pictures: those the model was made from, with the names it knows.
        shown: the board as it is on the screen.
        model: folder of COLMAP's cameras, images and points3D.
        T_object_model, scale: maps the model's points, times scale, into the object's frame; left
            out, the mesh was made in the model's own frame.

    Raises:
        InputError: "model-unreadable", "model-images", "model-camera" or "screen-unseen".
    """
    seen, K, lens, T_camera_model = _in_model(pictures, shown, model)
    here = _poses(seen, shown, K, lens)
    sure = _sure(here)
    _check_seen(sure, len(seen), here, None)
    i = np.searchsorted(here.frames, sure)
    T = T_camera_model[sure]
    T[:, :3, 3] *= scale
    T_model_object = np.eye(4) if T_object_model is None else inverse(T_object_model)
    return ScreenViews(
        here.T_camera_board[i],
        here.covariance[i],
        T @ T_model_object,
        np.tile(_MODEL_SIGMA, (len(sure), 1, 1)),
        np.eye(4),
        _MESH_SIGMA,
    )


def _in_model(
    pictures: Iterable[Photo], shown: Board, model: Path
) -> tuple[list[Corners], Float64[np.ndarray, "n 3 3"], np.ndarray, Float64[np.ndarray, "n 4 4"]]:
    """Corners, K, the one lens and T_camera_model of the pictures that the model knows."""
    known = _registered(model)
    detector = Detector(shown)
    seen: list[Corners] = []
    cameras: list[WitnessCamera] = []
    poses: list[np.ndarray] = []
    for picture in pictures:
        if picture.name not in known:
            continue
        T_camera_model, camera = known[picture.name]
        cameras.append(camera.at(picture.grey.shape[1], picture.grey.shape[0]))
        seen.append(detector.find(picture.grey))
        poses.append(T_camera_model)
    if not poses:
        raise InputError(
            "model-images",
            "None of the pictures is in the model.",
            where=str(model),
            fix="Give the folder of pictures that the model was made from.",
        )
    lens = cameras[0].lens
    if any(not np.array_equal(camera.lens, lens) for camera in cameras):
        raise InputError(
            "model-camera",
            "The pictures come from lenses that bend differently.",
            where=str(model),
            fix="Take the pictures of the screen with one camera at one zoom.",
        )
    return seen, np.array([camera.K for camera in cameras]), lens, np.array(poses)


def _poses(
    corners: list[Corners], board: Board | Checkerboard, K: np.ndarray, lens: np.ndarray
) -> BoardPoses:
    return board_poses([c.pixels for c in corners], [c.numbers for c in corners], board, K, lens)


def _sure(poses: BoardPoses) -> np.ndarray:
    """Frames in which the board's pose is the only one."""
    return poses.frames[~poses.ambiguous]


def _check_seen(both: np.ndarray, count: int, here: BoardPoses, there: BoardPoses | None) -> None:
    if len(both):
        return
    other = "" if there is None else f", {len(there.frames)} the one on the object"
    raise InputError(
        "screen-unseen",
        f"Of {count} pictures {len(here.frames)} show enough of the board on the screen{other}, "
        "none what is needed, at a slant.",
        fix="Come nearer and look at the screen at a slant (20 to 50 degrees), with its brightness "
        "up and no reflections in it.",
    )


def _registered(model: Path) -> dict[str, tuple[np.ndarray, WitnessCamera]]:
    """T_camera_model (OpenCV's axes) and the camera of each picture of a COLMAP model, by file name."""
    try:
        reconstruction = pycolmap.Reconstruction(str(model))
    except (ValueError, RuntimeError, OSError) as problem:
        raise InputError(
            "model-unreadable",
            f"No COLMAP model can be read: {str(problem)[:200]}",
            where=str(model),
            fix="Give the folder with cameras, images and points3D, such as sparse/0.",
        ) from None
    found: dict[str, tuple[np.ndarray, WitnessCamera]] = {}
    for image in reconstruction.images.values():
        if not image.has_pose:
            continue
        T = np.vstack([image.cam_from_world().matrix(), [0, 0, 0, 1]])
        found[Path(image.name).name] = T, _camera(reconstruction.cameras[image.camera_id], model)
    return found


def _camera(camera: pycolmap.Camera, model: Path) -> WitnessCamera:
    kind = camera.model.name
    if kind not in _LENSES:
        raise InputError(
            "model-camera",
            f"The model's lens {kind} is not OpenCV's.",
            where=str(model),
            fix=f"Reconstruct with one of {', '.join(_LENSES)}.",
        )
    K = camera.calibration_matrix()
    bent = camera.params[len(camera.params) - len(_LENSES[kind]) :]
    distortion = np.zeros(8 if kind == "FULL_OPENCV" else 5)
    distortion[list(_LENSES[kind])] = bent
    # COLMAP counts from the corner of the first pixel, OpenCV from its middle.
    return WitnessCamera(
        K[0, 0],
        K[1, 1],
        K[0, 2] - 0.5,
        K[1, 2] - 0.5,
        tuple(distortion.tolist()),
        (camera.width, camera.height),
        source=str(model),
    )
