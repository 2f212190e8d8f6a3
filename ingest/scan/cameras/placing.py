"""place: a reconstruction in metres, z up, by whatever says how long a metre is and where up is."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float64

from ingest.colmap import pycolmap
from ingest.formats.depth_png import load_millimetres
from ingest.report.check import Check
from ingest.scan.cameras.gravity import looked_at, upright
from ingest.scan.cameras.measured import by_length
from ingest.scan.cameras.metric import Similarity, to_phone
from ingest.scan.cameras.options import CameraOptions
from ingest.scan.cameras.pinholes import views_of
from ingest.scan.cameras.reconstruction import laid, names_of, points_of, poses_of
from ingest.scan.cameras.reference import by_reference
from ingest.scan.types import Frame, Progress, Scale
from omomo_core.errors import InputError

Up = Literal["arkit", "board", "floor", "cameras", "given"]
_LEVEL = np.cos(np.radians(15.0))
"""Between a board's normal and up, where it lies on the floor."""
_USUAL = 1.5
"""Metres from which people film; for a scan whose size is told at its end."""
_DIFFERENT = 0.02
"""Part by which two scales differ that do not agree."""
_WRONG = 1.25
"""Factor between two scales of which one must be a mistake."""
_FEWEST = 100
"""Points with a depth."""
_APART = 0.015
"""Part by which a phone's depth and poses differ about the metre when one of them is wrong."""
_DEPTH_SIGMA = 0.01
"""Standard deviation of the length of LiDAR's metre, as a part."""


@dataclass(frozen=True)
class ModelPlacement:
    """What gave a reconstruction its scale and its upright."""

    scale: Scale
    up: Up
    notes: tuple[Check, ...] = ()


def place(
    model: pycolmap.Reconstruction,
    frames: Mapping[str, Frame],
    options: CameraOptions,
    *,
    logged: bool,
    gravity: bool,
    straightened: Path,
    progress: Progress,
) -> ModelPlacement:
    """Lay a reconstruction into the world, in place.

    A board goes before a picked length, that before the phone's poses, and those before a height,
    which is only applied once the object has been cut out.

    Args:
        model: the reconstruction, of any size.
        frames: the pictures by their name.
        options: what somebody says.
        logged: whether the frames have poses that are to be used.
        gravity: whether z is up in them.
        straightened: folder for pictures whose lens is undone, to look for a board.
        progress: called with the stage "board".

    Raises:
        InputError: of `by_reference` and `by_length`; "scan-board-size" when a board contradicts the
            phone's poses by far.
    """
    if options.metric:
        return ModelPlacement(Scale(0.005, "given", "the model's own, as somebody says"), "given")
    names = names_of(model)
    placed = _by_phone(model, names, frames) if logged else None
    up: Up = "arkit"
    if placed is None or not gravity:
        turned = upright(poses_of(model, names), points_of(model))
        laid(model, turned.similarity)
        up = turned.by
    if options.board is not None or options.length is not None:
        return _measured(model, names, frames, options, placed, up, straightened, progress)
    if placed is not None:
        return _in_metres_of_depth(model, frames, placed, up)
    T = poses_of(model, names)
    distance = np.median(np.linalg.norm(T[:, :3, 3] - looked_at(T), axis=1))
    # Depth maps join in what follows only if the metre is theirs meanwhile.
    metres = _depth_scale(model, frames) or _USUAL / float(distance)
    laid(model, Similarity(metres, np.eye(3), np.zeros(3)))
    return ModelPlacement(Scale(0.5, "height", f"the object's height of {options.height} m"), up)


def _by_phone(
    model: pycolmap.Reconstruction, names: list[str], frames: Mapping[str, Frame]
) -> Scale:
    known = [n for n in names if frames[n].T_world_camera is not None]
    T = np.array([frames[n].T_world_camera for n in known])
    similarity = to_phone(T, poses_of(model, known))
    laid(model, similarity)
    return Scale(similarity.sigma, "arkit", f"the phone's poses ({len(known)} pictures)")


def _in_metres_of_depth(
    model: pycolmap.Reconstruction, frames: Mapping[str, Frame], by_poses: Scale, up: Up
) -> ModelPlacement:
    """The phone's metre; that of its depth where its poses clearly differ, as a short film's may.

    LiDAR measures each length by itself; the metre of poses is integrated from accelerations.
    """
    factor = _depth_scale(model, frames)
    if factor is None or abs(factor - 1) < _APART:
        return ModelPlacement(by_poses, up)
    laid(model, Similarity(factor, np.eye(3), np.zeros(3)))
    message = (
        f"The metre of the phone's depth is {factor:.3f} times as long as that of its poses; the "
        "first is taken, as the app does for its own mesh."
    )
    fix = "Measure the object's height, and give it or lay a board beside it if it matters."
    note = Check("metre", "warn", message, None, fix)
    return ModelPlacement(Scale(_DEPTH_SIGMA, "depth", "the phone's depth"), up, (note,))


def _measured(
    model: pycolmap.Reconstruction,
    names: list[str],
    frames: Mapping[str, Frame],
    options: CameraOptions,
    before: Scale | None,
    up: Up,
    straightened: Path,
    progress: Progress,
) -> ModelPlacement:
    """The size by a board or a length; place and up stay where a phone or the floor says them."""
    views = views_of(model, names, frames, straightened)
    if options.board is not None:
        board, scale = by_reference(views, options.board, lambda done: progress("board", done))
        factor = board.scale
        # What lies on the floor says better than a guess where up is.
        if up != "arkit" and board.R[2] @ [0.0, 0.0, 1.0] > _LEVEL:
            laid(model, Similarity(1.0, board.R, board.t / board.scale))
            up = "board"
    else:
        assert options.length is not None
        factor, scale = by_length(views, options.length)
    _check_factor(factor, before, scale)
    laid(model, Similarity(factor, np.eye(3), np.zeros(3)))
    return ModelPlacement(scale, up, _compared(factor, before, scale))


def _check_factor(factor: float, before: Scale | None, scale: Scale) -> None:
    """Refuse a size that differs from that of the phone's poses as a wrong unit or print would.

    Raises:
        InputError: "scan-board-size".
    """
    if before is None or max(factor, 1 / factor) < _WRONG:
        return
    raise InputError(
        "scan-board-size",
        f"By {scale.description} the object would be {factor:.2f} times as large as by "
        f"{before.description}; a phone's poses are never so far off.",
        where="--board" if scale.by == "board" else "--length",
        fix="Measure once more, of a marker the side of its black square; or leave the phone's poses "
        "out (--no-poses).",
    )


def _compared(factor: float, before: Scale | None, scale: Scale) -> tuple[Check, ...]:
    if before is None or abs(factor - 1) < _DIFFERENT:
        return ()
    message = (
        f"By {scale.description} the object is {factor:.3f} times as large as by "
        f"{before.description}; the first is taken."
    )
    fix = "Measure the object, and check the board's squares with a ruler."
    return (Check("scale", "warn", message, None, fix),)


def _depth_scale(model: pycolmap.Reconstruction, frames: Mapping[str, Frame]) -> float | None:
    """Metres in one unit of a reconstruction: sparse points against depth maps, median.

    Args:
        model: the reconstruction, of any size.
        frames: its pictures by their name.

    Returns:
        None where too few points have a depth.
    """
    ratios = [
        _ratios(model, image, frames[image.name])
        for image in model.images.values()
        if image.has_pose and image.name in frames
    ]
    found = np.concatenate([np.empty(0), *ratios])
    return float(np.median(found)) if len(found) >= _FEWEST else None


def _ratios(
    model: pycolmap.Reconstruction, image: pycolmap.Image, frame: Frame
) -> Float64[np.ndarray, " points"]:
    seen = [point for point in image.points2D if point.has_point3D()]
    if frame.depth is None or not seen:
        return np.empty(0)
    depth = load_millimetres(frame.depth)
    camera = model.cameras[image.camera_id]
    scale = np.array(depth.shape[::-1]) / [camera.width, camera.height]
    # COLMAP counts pixels from the corner of the first one.
    u, v = (np.array([point.xy for point in seen]) * scale).astype(int).T
    measured = depth[v.clip(0, depth.shape[0] - 1), u.clip(0, depth.shape[1] - 1)]
    T = image.cam_from_world().matrix()
    places = np.array([model.points3D[point.point3D_id].xyz for point in seen])
    z = places @ T[2, :3] + T[2, 3]
    known = (measured > 0) & (z > 0)
    return measured[known] / z[known]
