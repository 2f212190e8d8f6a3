"""Contact strips: when each hand holds, as coloured intervals over the time, with a cursor."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS
from render.lettering import DARK, FAINT, write
from render.props import CONTACT_COLOR

Picture = UInt8[np.ndarray, "h w 3"]

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
    """When the hands of one motion hold the object, on a clock it shares with others."""

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
    """Of the clock."""

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
