"""Line plots as SVG text: axes with units, shaded stretches, as many curves as needed.

Colours come from classes, so that the page's style sheet decides them in the light and in the dark.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np
from jaxtyping import Float64

_WIDTH, _LEFT, _RIGHT, _TOP, _BOTTOM = 720.0, 48.0, 14.0, 26.0, 28.0
_MAX_POINTS = 1500
"""Of a curve: more than the pixels of a screen are not seen."""
_TICKS = 6


@dataclass(frozen=True)
class PlotLine:
    """One curve; NaN breaks it."""

    x: Float64[np.ndarray, " points"]
    y: Float64[np.ndarray, " points"]
    kind: str
    """Class in the style sheet."""


@dataclass(frozen=True)
class Band:
    """A stretch of the x axis that is shaded."""

    start: float
    stop: float
    kind: str


@dataclass(frozen=True)
class Plot:
    """What one picture shows."""

    title: str
    x_unit: str
    y_unit: str
    lines: Sequence[PlotLine]
    bands: Sequence[Band] = ()
    dots: Sequence[tuple[float, float, str]] = field(default=())
    """x, y and a word beside it; above the first dot, below the others, which may coincide."""
    height: float = 200.0
    x_range: tuple[float, float] | None = None
    least_y: float = 0.0
    """Metres or whatever y is in that the y axis spans at least."""
    equal: bool = False
    """One unit is as long on both axes: a map."""


@dataclass(frozen=True)
class _Frame:
    """From data to pixels."""

    x0: float
    x1: float
    y0: float
    y1: float
    height: float

    def px(self, x: float) -> float:
        return _LEFT + (x - self.x0) / (self.x1 - self.x0) * (_WIDTH - _LEFT - _RIGHT)

    def py(self, y: float) -> float:
        room = self.height - _TOP - _BOTTOM
        return _TOP + (self.y1 - y) / (self.y1 - self.y0) * room


def draw(plot: Plot) -> str:
    """The plot as an <svg> element that scales to the width it is given."""
    frame = _frame(plot)
    parts = [
        f'<svg viewBox="0 0 {_WIDTH:g} {plot.height:g}" role="img" '
        f'aria-label="{escape(plot.title, quote=True)}">',
        *(_band(frame, band) for band in plot.bands),
        *_axes(frame, plot),
        *(_line(frame, line) for line in plot.lines),
        *(_dot(frame, *dot, 17.0 if k else -7.0) for k, dot in enumerate(plot.dots)),
        "</svg>",
    ]
    return "".join(parts)


def _frame(plot: Plot) -> _Frame:
    xs, ys = ([axis(line) for line in plot.lines] for axis in (lambda v: v.x, lambda v: v.y))
    x0, x1 = plot.x_range or _range(np.concatenate(xs), 0.0)
    y0, y1 = _range(np.concatenate(ys), plot.least_y)
    if plot.equal:
        across = (_WIDTH - _LEFT - _RIGHT) / (plot.height - _TOP - _BOTTOM)
        wide = max((x1 - x0) / across, y1 - y0)
        x0, x1 = _about(x0, x1, wide * across)
        y0, y1 = _about(y0, y1, wide)
    return _Frame(x0, x1, y0, y1, plot.height)


def _range(values: Float64[np.ndarray, " points"], least: float) -> tuple[float, float]:
    """Of the finite values, with a little room; down to zero where that is near."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 1.0)
    low = 0.0 if 0 <= low < 0.5 * high else low
    # What a number of this size can tell apart at all.
    span = max(high - low, least, 1e-6, 1e-9 * max(abs(low), abs(high)))
    return (low if low == 0.0 else low - 0.06 * span), low + 1.06 * span


def _about(low: float, high: float, span: float) -> tuple[float, float]:
    middle = (low + high) / 2
    return middle - span / 2, middle + span / 2


def ticks(low: float, high: float) -> list[float]:
    """Round numbers within a range: steps of 1, 2 or 5 times a power of ten."""
    rough = (high - low) / _TICKS
    power = 10.0 ** np.floor(np.log10(rough))
    step = float(next(power * k for k in (1, 2, 5, 10) if power * k >= rough))
    first = int(np.ceil(low / step - 1e-9))
    return [k * step for k in range(first, int(np.floor(high / step + 1e-9)) + 1)]


def _axes(frame: _Frame, plot: Plot) -> list[str]:
    left, right, foot = _LEFT, _WIDTH - _RIGHT, plot.height - _BOTTOM
    parts: list[str] = []
    for y in ticks(frame.y0, frame.y1):
        at = frame.py(y)
        parts.append(f'<path class="grid" d="M{left:g} {at:.1f}H{right:g}"/>')
        parts.append(_text(left - 8, at + 4, f"{y:.6g}", "end"))
    for x in ticks(frame.x0, frame.x1):
        at = frame.px(x)
        mark = (
            f'"grid" d="M{at:.1f} {foot:g}V{_TOP:g}'
            if plot.equal
            else f'"tick" d="M{at:.1f} {foot:g}v5'
        )
        parts.append(f'<path class={mark}"/>')
        # The last number makes room for the unit.
        if at < right - 24:
            parts.append(_text(at, foot + 20, f"{x:.6g}", "middle"))
    parts.append(f'<path class="axis" d="M{left:g} {foot:g}H{right:g}"/>')
    parts.append(_text(right, foot + 20, plot.x_unit, "end", "label"))
    parts.append(_text(left - 8, _TOP - 11, plot.y_unit, "end", "label"))
    return parts


def _text(x: float, y: float, text: str, anchor: str, kind: str = "number") -> str:
    return (
        f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
    )


def _band(frame: _Frame, band: Band) -> str:
    start, stop = (frame.px(min(max(x, frame.x0), frame.x1)) for x in (band.start, band.stop))
    # A fault of one step is to be seen too.
    width = max(stop - start, 2.0)
    height = frame.height - _TOP - _BOTTOM
    return (
        f'<rect class="{band.kind}" x="{start:.1f}" y="{_TOP:g}" width="{width:.1f}" '
        f'height="{height:g}"/>'
    )


def _line(frame: _Frame, line: PlotLine) -> str:
    every = max(1, -(-len(line.x) // _MAX_POINTS))
    path, pen = [], "M"
    for x, y in zip(line.x[::every], line.y[::every], strict=True):
        if np.isfinite(y) and np.isfinite(x):
            path.append(f"{pen}{frame.px(float(x)):.1f} {frame.py(float(y)):.1f}")
            pen = "L"
        else:
            pen = "M"
    return f'<path class="line {line.kind}" d="{"".join(path)}"/>'


def _dot(frame: _Frame, x: float, y: float, word: str, below: float) -> str:
    at, up = frame.px(x), frame.py(y)
    beyond = at > _WIDTH - 80
    place, anchor = (at - 9, "end") if beyond else (at + 9, "start")
    return f'<circle class="dot" cx="{at:.1f}" cy="{up:.1f}" r="4.5"/>' + _text(
        place, up + below, word, anchor, "label"
    )
