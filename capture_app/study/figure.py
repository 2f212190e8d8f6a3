"""The figure of a study: a bar for each two methods, divided as the votes were. SVG and PNG."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from capture_app.study.analysis import Preference
from render.stills import write_png

_WIDTH, _ROW, _BAR, _TOP, _FOOT = 760.0, 62.0, 30.0, 44.0, 40.0
_LEFT, _RIGHT = 30.0, 730.0
_FIRST, _SECOND = "#3f6fae", "#d9a35c"
_INK, _FAINT = "#33363a", "#85888c"
_SHARP = 2
"""Pixels of the PNG for one unit of the drawing."""

Anchor = Literal["start", "middle", "end"]


@dataclass(frozen=True)
class _Box:
    x: float
    y: float
    width: float
    height: float
    fill: str


@dataclass(frozen=True)
class _Words:
    x: float
    y: float
    text: str
    size: float
    fill: str
    anchor: Anchor = "start"


_Shape = _Box | _Words


def write_figure(folder: Path, preferences: Sequence[Preference]) -> None:
    """Write figure.svg and figure.png, which show the same.

    Each bar is the share of votes for two methods; the bracket below it is the 95 % interval of the
    border, the line in the middle is where nobody prefers either.
    """
    shapes, height = _shapes(preferences)
    (folder / "figure.svg").write_text(_svg(shapes, height), encoding="utf-8")
    write_png(folder / "figure.png", _png(shapes, height))


def _shapes(preferences: Sequence[Preference]) -> tuple[list[_Shape], float]:
    height = _TOP + _ROW * len(preferences) + _FOOT
    shapes: list[_Shape] = [_Box(0.0, 0.0, _WIDTH, height, "#ffffff")]
    shapes.append(_Words(_LEFT, 24.0, "Share of votes, with 95 % intervals", 15.0, _INK))
    for k, preference in enumerate(preferences):
        shapes += _bar(preference, _TOP + _ROW * k)
    foot = _TOP + _ROW * len(preferences)
    shapes.append(_Box(_at(0.5) - 0.75, _TOP - 6, 1.5, foot - _TOP + 6, "#55585c"))
    shapes += [
        _Words(_at(share), foot + 16, f"{share:.0%}", 12.0, _FAINT, "middle")
        for share in (0.0, 0.25, 0.5, 0.75, 1.0)
    ]
    return shapes, height


def _bar(preference: Preference, top: float) -> list[_Shape]:
    rate, border = preference.rate, _at(preference.rate.share)
    low, high, under = _at(rate.low), _at(rate.high), top + 19 + _BAR + 5
    bracket = [
        _Box(low, under - 1, high - low, 2.0, _INK),
        *(_Box(x - 1, under - 4, 2.0, 8.0, _INK) for x in (low, high)),
    ]
    return [
        _Words(_LEFT, top + 9, f"{preference.first}: {rate.share:.0%}", 13.0, _INK),
        _Words(_RIGHT, top + 9, f"{preference.second}: {1 - rate.share:.0%}", 13.0, _INK, "end"),
        _Box(_LEFT, top + 19, border - _LEFT, _BAR, _FIRST),
        _Box(border, top + 19, _RIGHT - border, _BAR, _SECOND),
        *bracket,
    ]


def _at(share: float) -> float:
    return _LEFT + share * (_RIGHT - _LEFT)


def _svg(shapes: Sequence[_Shape], height: float) -> str:
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:g} {height:g}" '
        f'width="{_WIDTH:g}" height="{height:g}" font-family="Helvetica, Arial, sans-serif">'
    ]
    for s in shapes:
        if isinstance(s, _Box):
            parts.append(
                f'<rect x="{s.x:.1f}" y="{s.y:.1f}" width="{s.width:.1f}" '
                f'height="{s.height:.1f}" fill="{s.fill}"/>'
            )
        else:
            parts.append(
                f'<text x="{s.x:.1f}" y="{s.y:.1f}" font-size="{s.size:g}" fill="{s.fill}" '
                f'text-anchor="{s.anchor}" dominant-baseline="central">{escape(s.text)}</text>'
            )
    return "\n".join([*parts, "</svg>", ""])


def _png(shapes: Sequence[_Shape], height: float) -> np.ndarray:
    image = Image.new("RGB", (round(_WIDTH * _SHARP), round(height * _SHARP)))
    draw = ImageDraw.Draw(image)
    anchors = {"start": "lm", "middle": "mm", "end": "rm"}
    for s in shapes:
        if isinstance(s, _Box):
            corners = [round(_SHARP * v) for v in (s.x, s.y, s.x + s.width, s.y + s.height)]
            if corners[2] > corners[0]:
                draw.rectangle((*corners[:2], corners[2] - 1, corners[3] - 1), fill=s.fill)
        else:
            font = ImageFont.load_default(_SHARP * s.size)
            at = (_SHARP * s.x, _SHARP * s.y)
            draw.text(at, s.text, fill=s.fill, font=font, anchor=anchors[s.anchor])
    return np.array(image)
