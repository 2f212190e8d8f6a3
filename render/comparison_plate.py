"""Comparisons as people see them: label, picture, contact strip and numbers, side by side."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt8

from render.backends import Backend
from render.comparison import Contender, clock, difference_scale, heat_legend, views
from render.lettering import (
    DARK,
    FAINT,
    HOLDS,
    PAPER,
    TRUE,
    Ink,
    Picture,
    Strip,
    contact_strip,
    fitted,
    text_width,
    write,
)
from render.video import contact_sheet

_BEST: Ink = (22, 128, 74)


@dataclass(frozen=True)
class PlateStyle:
    """How a comparison is drawn."""

    width: int = 480
    """Width of one contender's picture, pixels."""
    height: int = 360
    columns: int | None = None
    """Contenders side by side; 1 stacks them. None: up to four in a row, then a square."""
    heat: bool = False
    """Colour the bodies by their distance from the first one."""
    markers: bool = True
    backend: Backend = "auto"
    samples: int = 0
    """Multisampling, see `open_renderer`."""

    @property
    def unit(self) -> float:
        """Height of a letter, pixels."""
        return max(8.0, self.width / 36.0)


def comparison_frames(
    contenders: Sequence[Contender], style: PlateStyle, ticks: Sequence[int] | None = None
) -> Iterator[Picture]:
    """The comparison at each of some ticks of the common clock; without them, at all.

    Raises:
        InputError: heat is wanted of bodies with different meshes.
    """
    frames = clock(contenders)
    scale = difference_scale(contenders) if style.heat and len(contenders) > 1 else None
    strips = [_strip(c, frames, style.width, style.unit) for c in contenders]
    tables = [_numbers(c, style, _rows(contenders)) for c in contenders]
    order = range(frames) if ticks is None else ticks
    pictures = _views(contenders, order, style, scale)
    for tick, alone in zip(order, pictures, strict=True):
        plates = [
            np.concatenate([_head(c, tick, style), picture, strip.at([tick]), table])
            for c, picture, strip, table in zip(contenders, alone, strips, tables, strict=True)
        ]
        yield _with_legend(_grid(plates, style), contenders, style, scale)


def comparison_sheet(contenders: Sequence[Contender], style: PlateStyle, moments: int) -> Picture:
    """A row for each contender: pictures from the first to the last tick, strip and numbers."""
    frames = clock(contenders)
    scale = difference_scale(contenders) if style.heat and len(contenders) > 1 else None
    ticks = np.linspace(0, frames - 1, moments).round().astype(int).tolist()
    columns = list(zip(*_views(contenders, ticks, style, scale), strict=True))
    rows: list[Picture] = []
    for contender, pictures in zip(contenders, columns, strict=True):
        row = contact_sheet(list(pictures), moments)
        strip = _strip(contender, frames, row.shape[1], style.unit)
        head = _band(row.shape[1], 1.9 * style.unit)
        _write_line(head, contender, style.unit)
        rows.append(np.concatenate([head, row, strip.at(ticks)]))
    return _with_legend(np.concatenate(rows), contenders, style, scale)


def _views(
    contenders: Sequence[Contender], ticks: Sequence[int], style: PlateStyle, scale: float | None
) -> Iterator[list[Picture]]:
    return views(
        contenders,
        ticks,
        width=style.width,
        height=style.height,
        heat=scale,
        markers=style.markers,
        backend=style.backend,
        samples=style.samples,
    )


def _strip(contender: Contender, frames: int, width: int, unit: float) -> Strip:
    """Dark for a recorded person, as above the others."""
    color = TRUE if contender.truth else HOLDS
    return contact_strip(contender.held, frames, width, unit, contender.reference, color)


def _head(contender: Contender, tick: int, style: PlateStyle) -> Picture:
    band = _band(style.width, 1.9 * style.unit)
    u, y = style.unit, len(band) / 2
    state = "" if contender.lasts(tick) else "not begun" if tick < contender.begin else "ended"
    room = style.width - 7.0 * u if state else style.width - 1.4 * u
    write(band, fitted(contender.label, 1.1 * u, room), (0.7 * u, y), 1.1 * u)
    if state:
        write(band, state, (style.width - 0.7 * u, y), 0.95 * u, ink=FAINT, anchor="rm")
    return band


def _rows(contenders: Sequence[Contender]) -> int:
    """Lines of numbers, two in a line, so that all plates are as high."""
    return max(-(-len(c.numbers) // 2) for c in contenders)


def _numbers(contender: Contender, style: PlateStyle, rows: int) -> Picture:
    u = style.unit
    table = _band(style.width, (1.35 * rows + 0.6) * u)
    half = style.width / 2
    for k, number in enumerate(contender.numbers):
        left = k // rows * half + 0.7 * u
        y = (0.95 + 1.35 * (k % rows)) * u
        write(table, number.name, (left, y), 0.92 * u, ink=FAINT)
        right = left + half - 1.6 * u
        ink = _BEST if number.best else DARK
        write(table, number.value, (right, y), 0.92 * u, ink=ink, anchor="rm")
    return table


def _write_line(band: Picture, contender: Contender, unit: float) -> None:
    """The label, and as many numbers after it as fit."""
    x, y = 0.7 * unit, len(band) / 2
    label = fitted(contender.label, 1.1 * unit, 0.4 * band.shape[1])
    write(band, label, (x, y), 1.1 * unit)
    x += text_width(label, 1.1 * unit) + 2.5 * unit
    for number in contender.numbers:
        words = f"{number.name} {number.value}"
        wide = text_width(words, 0.92 * unit)
        if x + wide > band.shape[1]:
            return
        write(band, words, (x, y), 0.92 * unit, ink=_BEST if number.best else FAINT)
        x += wide + 1.6 * unit


def _grid(plates: Sequence[Picture], style: PlateStyle) -> UInt8[np.ndarray, "grid_h grid_w 3"]:
    """Plates in rows, on paper."""
    columns = _columns(len(plates), style.columns)
    empty = np.full_like(plates[0], PAPER)
    filled = [*plates, *[empty] * (-len(plates) % columns)]
    gap = max(2, round(0.3 * style.unit))
    upright = np.full((len(empty), gap, 3), PAPER, np.uint8)
    rows: list[Picture] = []
    for k in range(0, len(filled), columns):
        parts = [p for plate in filled[k : k + columns] for p in (upright, plate)][1:]
        rows.append(np.concatenate(parts, axis=1))
    level = np.full((gap, rows[0].shape[1], 3), PAPER, np.uint8)
    return np.concatenate([p for row in rows for p in (level, row)][1:])


def _columns(count: int, asked: int | None) -> int:
    if asked is not None:
        return min(asked, count)
    return count if count <= 4 else int(np.ceil(np.sqrt(count)))


def _with_legend(
    picture: Picture, contenders: Sequence[Contender], style: PlateStyle, scale: float | None
) -> UInt8[np.ndarray, "taller_h w 3"]:
    if scale is None:
        return picture
    band = _band(picture.shape[1], 2.0 * style.unit)
    words = f"distance from {contenders[0].label}"
    heat_legend(band, fitted(words, style.unit, 0.5 * picture.shape[1]), scale, style.unit)
    return np.concatenate([picture, band])


def _band(width: int, height: float) -> Picture:
    return np.full((round(height), width, 3), PAPER, np.uint8)
