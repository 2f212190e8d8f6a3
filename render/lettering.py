"""Words on pictures: captions, and contact strips below them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Bool, UInt8
from PIL import Image, ImageDraw, ImageFont

from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS
from render.props import CONTACT_COLOR

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


PAPER = (250, 249, 247)
HOLDS = (
    round(255 * CONTACT_COLOR[0]),
    round(255 * CONTACT_COLOR[1]),
    round(255 * CONTACT_COLOR[2]),
)
TRUE = (92, 96, 104)
_LANE = (232, 231, 228)
_CURSOR = (206, 66, 52)
_STEPS = (1, 2, 5, 10, 20, 30, 60, 120, 300, 600)
"""Seconds between two numbers below the strip."""


@dataclass(frozen=True)
class Held:
    """The times at which the hands of one motion hold the object, on a clock it shares with others."""

    contact: Bool[np.ndarray, "frames 2"]
    """Left, right hand."""
    begin: int = 0
    """Its first frame on the common clock."""


@dataclass(frozen=True)
class Strip:
    """A strip and where its clock is drawn on it."""

    picture: Picture
    left: int
    """Pixel column of frame 0."""
    right: int
    """Pixel column one past the last frame."""
    foot: int
    """Pixel row below the lanes."""
    frames: int
    """Frames of the clock."""

    def column(self, frame: float | int) -> int:
        """Pixel column at which a frame begins."""
        return self.left + round((self.right - self.left) * frame / self.frames)

    def at(self, frames: Sequence[int]) -> Picture:
        """The strip with a cursor at each of some frames of the clock."""
        out = self.picture.copy()
        for frame in frames:
            x = self.column(frame + 0.5)
            cv2.line(out, (x, 0), (x, self.foot), _CURSOR, max(1, len(out) // 45))
        return out


def contact_strip(
    held: Held,
    frames: int,
    width: int,
    unit: float,
    truth: Held | None = None,
    color: tuple[int, int, int] = HOLDS,
) -> Strip:
    """A lane for each hand; dark above it, when the hand of the truth holds.

    Args:
        held: the motion's contacts; its lane is grey where the motion lasts.
        frames: length of the common clock.
        width: pixels.
        unit: pixels of a letter's height; everything grows with it.
        truth: the contacts of the recorded person, if known.
        color: of the lane while the hand holds.
    """
    lane, gap, thin = round(0.9 * unit), round(0.35 * unit), round(0.35 * unit)
    height = 2 * (thin + lane + gap) + round(1.3 * unit)
    strip = Strip(
        picture=np.full((height, width, 3), PAPER, np.uint8),
        left=round(1.7 * unit),
        right=width - round(unit),
        foot=2 * (thin + lane + gap),
        frames=frames,
    )
    top = gap // 2
    for hand, name in enumerate("LR"):
        if truth:
            _bars(strip, truth, hand, (top, top + thin), TRUE, None)
        row = (top + thin, top + thin + lane)
        _bars(strip, held, hand, row, color, _LANE)
        middle = (0.8 * unit, sum(row) / 2)
        write(strip.picture, name, middle, 0.85 * unit, ink=DARK, anchor="mm")
        top = row[1] + gap
    _clock(strip, top, unit)
    return strip


def _bars(
    strip: Strip,
    held: Held,
    hand: int,
    rows: tuple[int, int],
    color: tuple[int, ...],
    lane: tuple[int, ...] | None,
) -> None:
    part = strip.picture[rows[0] : rows[1]]
    first, last = (strip.column(f) for f in (held.begin, held.begin + len(held.contact)))
    if lane is not None:
        part[:, max(first, strip.left) : last] = lane
    for start, stop in runs(held.contact[:, hand]):
        a, b = (strip.column(held.begin + f) for f in (start, stop))
        part[:, a : max(b, a + 1)] = color


def _clock(strip: Strip, top: int, unit: float) -> None:
    """Seconds below the lanes, as many numbers as fit."""
    seconds = strip.frames / FPS
    room = (strip.right - strip.left) / (3.0 * unit)
    step = next((s for s in _STEPS if seconds / s <= room), _STEPS[-1])
    for second in range(0, int(seconds) + 1, step):
        x = strip.column(second * FPS)
        strip.picture[top : top + max(2, round(0.2 * unit)), x : x + 1] = FAINT
        text = f"{second} s" if second == 0 else str(second)
        write(strip.picture, text, (x, top + 0.75 * unit), 0.7 * unit, ink=FAINT, anchor="mm")
