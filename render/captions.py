"""Small text on pictures: a label above, the time below."""

import cv2
import numpy as np
from jaxtyping import UInt8

from render.lettering import write

_INK = (82, 84, 88)
_LETTERS = 17.0
"""Their size in a picture of 540 rows."""


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
        write(out, label, (margin, margin), 1.15 * _LETTERS * unit, ink=_INK)
    if seconds is not None:
        write(out, time_code(seconds), (margin, out.shape[0] - margin), _LETTERS * unit, ink=_INK)
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
    write(image, "1 m", (left + tick, y - 3 * tick), _LETTERS * unit, ink=_INK)


def time_code(seconds: float) -> str:
    """Minutes, seconds and tenths: 75.04 is "1:15.0"."""
    tenths = int(seconds * 10.0 + 1e-6)
    return f"{tenths // 600}:{tenths // 10 % 60:02d}.{tenths % 10}"
