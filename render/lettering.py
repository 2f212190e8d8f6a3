"""Words on pictures, in the font that Pillow brings along."""

from functools import cache
from typing import Literal

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

Picture = UInt8[np.ndarray, "h w 3"]
Ink = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""
Anchor = Literal["lm", "mm", "rm"]
"""Which point of the text is put in its place: left, middle or right, halfway up."""

DARK: Ink = (52, 54, 58)
FAINT: Ink = (120, 122, 127)
_FINE = 4
"""Pixels to one of the picture while a letter is drawn."""


def write(
    picture: Picture,
    text: str,
    at: tuple[float | int, float | int],
    size: float,
    *,
    ink: Ink = DARK,
    anchor: Anchor = "lm",
) -> None:
    """Write a line of text into a picture, in place.

    Args:
        picture: to be changed.
        text: the line.
        at: x and y of its anchor, pixels.
        size: of the font, pixels.
        ink: colour.
        anchor: which point of the line `at` is.
    """
    box = _font(size).getbbox(text, anchor=anchor)
    if box[2] <= box[0]:
        return
    # Drawn large and made small: letters stand where they belong, not on whole pixels.
    left, top = (int(np.floor(at[k] + box[k] / _FINE)) - 1 for k in (0, 1))
    right, foot = (int(np.ceil(at[k] + box[k + 2] / _FINE)) + 1 for k in (0, 1))
    large = Image.new("L", (_FINE * (right - left), _FINE * (foot - top)))
    start = (_FINE * (at[0] - left), _FINE * (at[1] - top))
    ImageDraw.Draw(large).text(start, text, fill=255, font=_font(size), anchor=anchor)
    share = np.asarray(large.reduce(_FINE), np.float32)[..., None] / 255.0
    height, width = picture.shape[:2]
    x0, y0, x1, y1 = max(left, 0), max(top, 0), min(right, width), min(foot, height)
    if x1 <= x0 or y1 <= y0:
        return
    part, seen = picture[y0:y1, x0:x1], share[y0 - top : y1 - top, x0 - left : x1 - left]
    part[:] = (part + seen * (np.array(ink) - part)).round().astype(np.uint8)


def text_width(text: str, size: float) -> float:
    """Pixels that a line of text is wide."""
    return float(_font(size).getlength(text)) / _FINE


def fitted(text: str, size: float, width: float) -> str:
    """The text, its end replaced by dots where it is wider than `width` pixels."""
    if text_width(text, size) <= width:
        return text
    kept = len(text)
    while kept and text_width(f"{text[:kept]}...", size) > width:
        kept -= 1
    return f"{text[:kept]}..."


@cache
def _font(size: float) -> "ImageFont.FreeTypeFont | ImageFont.ImageFont":
    """Larger than asked for by `_FINE`."""
    return ImageFont.load_default(_FINE * size)
