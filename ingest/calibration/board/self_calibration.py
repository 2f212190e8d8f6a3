"""The witness camera calibrated from the very video of the board."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float64, Int

from ingest.calibration.board.camera import WitnessCamera
from ingest.calibration.board.spec import Grid
from omomo_core.errors import InputError

_CORNERS = 10
_VIEWS, _ENOUGH = 40, 8
_DIFFERENT = 0.04
"""Widths of the picture by which views differ (all four corners of the board together) to count."""
_FLAGS = cv2.CALIB_FIX_K3
"""k1, k2, p1 and p2: left out, p1 and p2 would make the centre look surer than it is."""
_MAX_RMS = 2.0
_MAX_FOCAL, _MAX_CENTRE = 0.01, 0.02
"""One sigma of the focal lengths as a part of them, of the centre as a part of the width."""
_WILD = 3.0


def calibrate_camera(
    pixels: Sequence[Float64[np.ndarray, "_ 2"]],
    numbers: Sequence[Int[np.ndarray, " _"]],
    board: Grid,
    size: tuple[int, int],
) -> WitnessCamera:
    """Focal lengths, centre, k1 and k2 from views of the board (Zhang 2000), with their sigmas.

    Up to 40 views that differ most are used.

    Args:
        pixels, numbers: corners of each picture.
        board: which board it is; a wrong size of its squares does not matter here.
        size: width and height of the pictures.

    Raises:
        InputError: "camera-calibration" when views are too few or too alike to tell, or do not fit.
    """
    views = [
        (np.asarray(p, np.float32).reshape(-1, 1, 2), board.corners[n].astype(np.float32))
        for p, n in zip(pixels, numbers, strict=True)
        if len(n) >= _CORNERS and _spread(n, board)
    ]
    if len(views) < _ENOUGH:
        raise _refusal(f"only {len(views)} pictures show {_CORNERS} corners or more")
    picked = [views[i] for i in _diverse([_outline(*v, board, size) for v in views])]
    if len(picked) < _ENOUGH:
        raise _refusal(f"the views are too alike: only {len(picked)} of {len(views)} differ")
    _, _, _, _, errors = _solve(picked, size)
    kept = [v for v, e in zip(picked, errors, strict=True) if e <= _WILD * np.median(errors)]
    rms, K, lens, sigmas, _ = _solve(kept, size)
    if rms > _MAX_RMS:
        raise _refusal(f"the corners are {rms:.1f} px off the best camera")
    loose = max(sigmas[0] / K[0, 0], sigmas[1] / K[1, 1])
    if loose > _MAX_FOCAL or max(sigmas[2:]) > _MAX_CENTRE * size[0]:
        raise _refusal(
            f"the views are too alike: the focal length is known to {100 * loose:.1f} %, the "
            f"centre to {max(sigmas[2:]):.0f} px (one sigma)"
        )
    return WitnessCamera(
        fx=float(K[0, 0]),
        fy=float(K[1, 1]),
        cx=float(K[0, 2]),
        cy=float(K[1, 2]),
        distortion=tuple(float(k) for k in lens),
        size=size,
        sigmas=(sigmas[0], sigmas[1], sigmas[2], sigmas[3]),
        source=f"calibrated from {len(kept)} views of the board, {rms:.2f} px rms",
    )


View = tuple[np.ndarray, np.ndarray]


def _solve(
    views: Sequence[View], size: tuple[int, int]
) -> tuple[float, np.ndarray, np.ndarray, list[float], np.ndarray]:
    """rms (px), camera matrix, coefficients, sigmas of fx fy cx cy, rms of each view."""
    guess = cv2.initCameraMatrix2D([p for _, p in views], [c for c, _ in views], size)
    try:
        rms, K, lens, _, _, sigmas, _, errors = cv2.calibrateCameraExtended(
            [p for _, p in views],
            [c for c, _ in views],
            size,
            np.asarray(guess, float),
            np.zeros(5),
            flags=_FLAGS | cv2.CALIB_USE_INTRINSIC_GUESS,
        )
    except cv2.error:
        raise _refusal("no camera explains the views") from None
    deviations = [float(s) for s in np.ravel(sigmas)[:4]]
    return float(rms), np.asarray(K, float), np.ravel(lens), deviations, np.ravel(errors)


def _spread(numbers: Int[np.ndarray, " corners"], board: Grid) -> bool:
    """Whether there are corners of two columns and two rows."""
    across, down = numbers % (board.columns - 1), numbers // (board.columns - 1)
    return bool(np.ptp(across) > 0 and np.ptp(down) > 0)


def _outline(
    corners: np.ndarray, points: np.ndarray, board: Grid, size: tuple[int, int]
) -> Float64[np.ndarray, "8"]:
    """Where the board's own four corners would be in the picture, in widths: tells the whole view."""
    H, _ = cv2.findHomography(points[:, :2], corners.reshape(-1, 2))
    outer = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [board.width, board.height]
    mapped = np.concatenate([outer, np.ones((4, 1))], axis=1) @ np.asarray(H, float).T
    return np.clip(mapped[:, :2] / mapped[:, 2:] / size[0], -3, 3).ravel()


def _diverse(outlines: Sequence[Float64[np.ndarray, "8"]]) -> list[int]:
    """Views as different as possible: each next one is the farthest from those taken.

    Many of the same view would make the camera look surer than it is.
    """
    shapes = np.stack(outlines)
    far = np.linalg.norm(shapes - shapes.mean(axis=0), axis=1)
    taken = [int(far.argmax())]
    far = np.linalg.norm(shapes - shapes[taken[0]], axis=1)
    while len(taken) < _VIEWS and far.max() > _DIFFERENT:
        taken.append(int(far.argmax()))
        far = np.minimum(far, np.linalg.norm(shapes - shapes[taken[-1]], axis=1))
    return taken


def _refusal(why: str) -> InputError:
    return InputError(
        "camera-calibration",
        f"The camera cannot be calibrated from this video: {why}.",
        fix="Tilt the board 30 to 45 degrees to all four sides, near and far, and bring it into the "
        "corners of the picture; or give the camera's intrinsics as a file.",
    )
