"""clock_offset: when a resting camera's film shows the motion, by what changes where the object is."""

import cv2
import numpy as np
from jaxtyping import Float64, Int64

from capture_app.overlay.film import TimedPictures
from ingest.calibration.board.board_lens import distorted
from ingest.calibration.hand_eye.hand_eye_guess import peak
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMotion

_WIDTH = 240
"""Pixels across the reduced pictures."""
_RATE = 15.0
"""Pictures a second that are looked at, at most."""
_STEP = 1 / 30
"""Seconds between the offsets that are tried."""
_LEAST_OVERLAP = 0.4
"""Part of the shorter of film and motion that must lie within the other."""
_NOISE = 6
"""Grey levels that a picture that shows the same may differ by."""
_SURE, _APART, _RIVAL = 0.5, 0.5, 0.9
"""Correlation of a right offset; seconds to another one, which must be worse by this factor."""


def clock_offset(
    film: TimedPictures,
    moved: ObjectMotion,
    T_world_camera: Float64[np.ndarray, "4 4"],
    K: Float64[np.ndarray, "3 3"],
    lens: Float64[np.ndarray, " coefficients"],
) -> float:
    """Seconds to add to the film's times to get the motion's.

    Where the object would be in a picture, the film changes as fast as the object would move across
    it: the offset at which the two agree best over the whole film.

    Args:
        film: of a camera that stood still.
        moved: the object in the world.
        T_world_camera: OpenCV's axes (x right, y down, z ahead).
        K, lens: of the film's pixels, and OpenCV's distortion.

    Raises:
        InputError: "offset-needed" when no offset fits, or several do.
    """
    times, changed = _changes(film)
    boxes, speed = _seen(moved, T_world_camera, K, lens, _WIDTH / film.size[0])
    length = (len(speed) - 1) / FPS
    offsets = np.arange(-times[-1], length - times[0], _STEP)
    score = np.array([_agreement(times + o, changed, boxes, speed, length) for o in offsets])
    best = int(score.argmax())
    far = np.abs(offsets - offsets[best]) > _APART
    rival = float(score[far].max(initial=0.0))
    if score[best] < _SURE or rival > _RIVAL * score[best]:
        raise InputError(
            "offset-needed",
            "What moves in the film does not tell when it was taken: "
            + (
                f"at best it agrees with the object's motion by {score[best]:.2f} of 1."
                if score[best] < _SURE
                else f"{offsets[best]:.1f} s and {offsets[far][score[far].argmax()]:.1f} s fit alike."
            ),
            where=str(film.source),
            fix="Give --offset SECONDS: what to add to the film's time to get the motion's, such as "
            "the time in the motion minus that in the film at which the object leaves the floor.",
        )
    return float(offsets[best] + _STEP * peak(score, best))


def _changes(film: TimedPictures) -> tuple[Float64[np.ndarray, " n"], Int64[np.ndarray, "n h w"]]:
    """Middle times of picture pairs, and sums of grey change left of and above each pixel."""
    every = max(1, round(1 / (_RATE * float(np.median(np.diff(film.times))))))
    height = round(film.size[1] * _WIDTH / film.size[0])
    sums: list[np.ndarray] = []
    before = None
    for k, picture in enumerate(film.read(0, len(film.times))):
        if k % every:
            continue
        grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        grey = cv2.resize(grey, (_WIDTH, height), interpolation=cv2.INTER_AREA)
        if before is not None:
            change = cv2.absdiff(grey, before)
            sums.append(cv2.integral(np.where(change > _NOISE, change, 0).astype(np.uint8)))
        before = grey
    kept = film.times[::every]
    return (kept[1:] + kept[:-1]) / 2, np.array(sums, np.int64)


def _seen(
    moved: ObjectMotion,
    T_world_camera: Float64[np.ndarray, "4 4"],
    K: Float64[np.ndarray, "3 3"],
    lens: Float64[np.ndarray, " coefficients"],
    shrink: float,
) -> tuple[Float64[np.ndarray, "frames 4"], Float64[np.ndarray, " frames"]]:
    """Left, top, right, bottom of the object in the reduced pictures; pixels a second it moves."""
    some = moved.mesh.vertices[:: max(1, len(moved.mesh.vertices) // 200)]
    T = inverse(T_world_camera) @ moved.T_world_object
    points = some @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
    flat = points[..., :2] / np.maximum(points[..., 2:], 0.05)
    bent = distorted(flat.reshape(-1, 2), lens).reshape(flat.shape) if lens.any() else flat
    pixels = shrink * (bent * K[[0, 1], [0, 1]] + K[:2, 2])
    steps = np.linalg.norm(np.gradient(pixels, 1 / FPS, axis=0), axis=-1).mean(axis=1)
    ahead = (points[..., 2] > 0.05).all(axis=1)
    return np.concatenate([pixels.min(axis=1), pixels.max(axis=1)], axis=1), np.where(
        ahead, steps, np.nan
    )


def _agreement(
    at: Float64[np.ndarray, " n"],
    changed: Int64[np.ndarray, "n h w"],
    boxes: Float64[np.ndarray, "frames 4"],
    speed: Float64[np.ndarray, " frames"],
    length: float,
) -> float:
    """Correlation of how much the film changes where the object is with how fast it moves there."""
    inside = np.flatnonzero((at >= 0) & (at <= length))
    if (at[inside].max(initial=0) - at[inside].min(initial=length)) < _LEAST_OVERLAP * min(
        length, at[-1] - at[0]
    ):
        return 0.0
    frame = np.rint(at[inside] * FPS).astype(int)
    height, width = changed.shape[1] - 1, changed.shape[2] - 1
    box = boxes[frame].clip(0, [width, height, width, height]).round().astype(int)
    area = (box[:, 2] - box[:, 0]) * (box[:, 3] - box[:, 1])
    good = (area > 0) & np.isfinite(speed[frame])
    x0, y0, x1, y1 = box[good].T
    k = inside[good]
    sums = changed[k, y1, x1] - changed[k, y0, x1] - changed[k, y1, x0] + changed[k, y0, x0]
    a, b = np.log1p(sums / area[good]), np.log1p(speed[frame[good]])
    if len(a) < 3 or a.std() < 1e-6 or b.std() < 1e-6:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])
