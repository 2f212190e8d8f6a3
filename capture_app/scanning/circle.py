"""circle: from which directions an object was filmed, as SVG text seen from above."""

import numpy as np

from ingest.scan.quality.coverage import Coverage

_SIDE, _RADIUS = 320.0, 130.0
_RINGS = ((0.0, "level"), (30.0, "30°"), (60.0, "60°"))
_SHOWN_GAP = 40.0
"""Degrees without a picture that are shaded."""


def circle(coverage: Coverage) -> str:
    """A dot for each picture: near the rim it was taken from the level, near the middle from above.

    The film begins below; to its right is where a person walks to who faces the object.
    """
    parts = [f'<svg viewBox="0 0 {_SIDE:g} {_SIDE:g}" role="img" aria-label="Directions filmed">']
    start, width = coverage.gap
    if width > _SHOWN_GAP:
        parts.append(_sector(start, width))
    for elevation, word in _RINGS:
        x, y = _place(180.0, elevation)
        radius = _RADIUS * (1 - elevation / 90)
        middle = _SIDE / 2
        parts.append(f'<circle class="axis" cx="{middle}" cy="{middle}" r="{radius:.1f}"/>')
        parts.append(f'<text x="{x:.1f}" y="{y - 4:.1f}" text-anchor="middle">{word}</text>')
    for azimuth, elevation in zip(coverage.azimuth, coverage.elevation, strict=True):
        x, y = _place(float(azimuth), float(elevation))
        parts.append(f'<circle class="dot" cx="{x:.1f}" cy="{y:.1f}" r="4"/>')
    x, y = _place(0.0, -12.0)
    parts.append(
        f'<text class="label" x="{x:.1f}" y="{y + 8:.1f}" text-anchor="middle">start</text>'
    )
    return "".join([*parts, "</svg>"])


def _place(azimuth: float, elevation: float) -> tuple[float, float]:
    """Pixels; counter-clockwise from below."""
    radius = _RADIUS * (1 - np.clip(elevation, -15, 90) / 90)
    turn = np.radians(azimuth)
    return _SIDE / 2 + radius * np.sin(turn), _SIDE / 2 + radius * np.cos(turn)


def _sector(start: float, width: float) -> str:
    x0, y0 = _place(start, 0.0)
    x1, y1 = _place(start + min(width, 359.9), 0.0)
    large, middle = int(width > 180), _SIDE / 2
    return (
        f'<path class="gap" d="M{middle} {middle}L{x0:.1f} {y0:.1f}'
        f'A{_RADIUS:g} {_RADIUS:g} 0 {large} 0 {x1:.1f} {y1:.1f}Z"/>'
    )
