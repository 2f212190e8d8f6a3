"""Small text on pictures: a label above, the time below."""

import cv2
import numpy as np
from jaxtyping import UInt8

_INK = (82, 84, 88)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def caption(
    picture: UInt8[np.ndarray, "h w 3"],
    *,
    label: str = "",
    seconds: float | None = None,
    pixels_per_metre: float | None = None,
) -> UInt8[np.ndarray, "h w 3"]:
    """A copy with a label in the top left corner, a time code and a scale bar at the bottom."""
    out = picture.copy()
    unit = max(picture.shape[0], 180) / 540.0
    margin = round(22 * unit)
    if label:
        _write(out, label, (margin, margin + round(14 * unit)), 0.60 * unit)
    if seconds is not None:
        _write(out, time_code(seconds), (margin, out.shape[0] - margin), 0.52 * unit)
    if pixels_per_metre is not None:
        _scale_bar(out, pixels_per_metre, unit, margin)
    return out


def _scale_bar(
    image: UInt8[np.ndarray, "h w 3"], pixels_per_metre: float, unit: float, margin: int
) -> None:
    """One metre in the bottom right corner."""
    tick, y = round(5 * unit), image.shape[0] - margin
    right = image.shape[1] - margin
    left = right - round(pixels_per_metre)
    width = max(1, round(1.4 * unit))
    cv2.line(image, (left, y), (right, y), _INK, width, cv2.LINE_AA)
    for x in (left, right):
        cv2.line(image, (x, y - tick), (x, y + tick), _INK, width, cv2.LINE_AA)
    _write(image, "1 m", (left + tick, y - 2 * tick), 0.52 * unit)


def time_code(seconds: float) -> str:
    """Minutes, seconds and tenths: 75.04 is "1:15.0"."""
    tenths = int(seconds * 10.0 + 1e-6)
    return f"{tenths // 600}:{tenths // 10 % 60:02d}.{tenths % 10}"


def _write(image: UInt8[np.ndarray, "h w 3"], text: str, at: tuple[int, int], size: float) -> None:
    cv2.putText(image, text, at, _FONT, size, _INK, 1, cv2.LINE_AA)
