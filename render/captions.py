"""Small text on pictures: a label above, the time below."""

import cv2
import numpy as np
from jaxtyping import UInt8

_INK = (82, 84, 88)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def caption(
    picture: UInt8[np.ndarray, "h w 3"], *, label: str = "", seconds: float | None = None
) -> UInt8[np.ndarray, "h w 3"]:
    """A copy with `label` in the top left corner and a time code in the bottom left one."""
    out = picture.copy()
    unit = max(picture.shape[0], 180) / 540.0
    margin = round(22 * unit)
    if label:
        _write(out, label, (margin, margin + round(14 * unit)), 0.60 * unit)
    if seconds is not None:
        _write(out, time_code(seconds), (margin, out.shape[0] - margin), 0.52 * unit)
    return out


def time_code(seconds: float) -> str:
    """Minutes, seconds and tenths: 75.04 is "1:15.0"."""
    tenths = int(seconds * 10.0 + 1e-6)
    return f"{tenths // 600}:{tenths // 10 % 60:02d}.{tenths % 10}"


def _write(image: UInt8[np.ndarray, "h w 3"], text: str, at: tuple[int, int], size: float) -> None:
    cv2.putText(image, text, at, _FONT, size, _INK, 1, cv2.LINE_AA)
