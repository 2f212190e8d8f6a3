"""scan_page: a scan's report as one HTML text, every word of it escaped."""

from base64 import b64encode
from collections.abc import Mapping
from html import escape

import cv2
import numpy as np
from jaxtyping import UInt8

from capture_app.commands.scan import ScanRequest
from capture_app.report_page.checks import listed
from capture_app.report_page.style import STYLE
from ingest.report.take_checks import Severity
from ingest.scan.clean_mesh import CleanMesh
from ingest.scan.scan_quality import Coverage, ScanReport
from ingest.scan.scanned_object import ScannedObject

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


_WORDS: dict[Severity, str] = {
    "ok": "This scan is good",
    "warn": "This scan is usable with limits",
    "bad": "This scan is not usable as it is",
}
_STYLE = """
figure img { display:block; width:100%; height:auto; border-radius:8px; }
figure.small svg { max-width:26rem; margin:0 auto; }
.gap { fill:var(--bad); opacity:.3; }
figcaption { color:var(--quiet); font-size:.88rem; padding:.5rem 0 .4rem; }
"""
_QUALITY = 88


def scan_page(
    request: ScanRequest,
    cleaned: CleanMesh,
    report: ScanReport,
    found: ScannedObject | None,
    pictures: Mapping[str, UInt8[np.ndarray, "h w 3"]],
) -> str:
    """The whole page; it loads nothing from anywhere.

    Args:
        request, cleaned, report, found: of the scan.
        pictures: by what is written below them.
    """
    name = escape(request.output.name)
    shown = "".join(_figure(words, picture) for words, picture in pictures.items())
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{name}: scan report</title><style>{STYLE}{_STYLE}</style></head><body><main>"
        f"<header><p>Scan report</p><h1>{name}</h1></header>"
        f"{_verdict(report)}{_facts(cleaned, found, report)}"
        f"<h2>Pictures</h2>{shown}{_around(report)}"
        f"<h2>Checks</h2>{listed(report.checks)}"
        f"<footer>{escape(str(request.source))}</footer></main></body></html>\n"
    )


def _verdict(report: ScanReport) -> str:
    troubles = report.of("bad") or report.of("warn")
    advice = next((check.fix for check in troubles if check.fix), "")
    summary = f"To do first: {advice}" if advice else "Nothing is to be done: use it."
    words = _WORDS[report.severity]
    return (
        f'<section class="verdict {report.severity}"><strong>{words}</strong>'
        f"<p>{escape(summary)}</p></section>"
    )


def _facts(cleaned: CleanMesh, found: ScannedObject | None, report: ScanReport) -> str:
    sides = np.ptp(cleaned.mesh.vertices, axis=0)
    facts = [
        ("Size, metres", " × ".join(f"{side:.2f}" for side in sides)),
        ("Vertices", f"{len(cleaned.mesh.vertices):,}"),
        ("Surface", "closed" if cleaned.watertight else "open"),
    ]
    if found is not None:
        views, absent = len(found.registered.views), len(found.registered.left_out)
        facts.append(("Pictures placed", f"{views} of {views + absent}"))
        sure = "nothing" if report.cut_off else f"{found.registered.scale.sigma:.1%}"
        facts.append(("Size is sure to", sure))
        facts.append(
            ("Measured by", {"both": "pictures and depth"}.get(found.method, found.method))
        )
    cells = "".join(f"<div><dt>{label}</dt><dd>{value}</dd></div>" for label, value in facts)
    return f'<dl class="facts">{cells}</dl>'


def _figure(words: str, picture: UInt8[np.ndarray, "h w 3"]) -> str:
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()
    source = f"data:image/jpeg;base64,{b64encode(data).decode()}"
    text = escape(words)
    return f'<figure><img src="{source}" alt="{text}"><figcaption>{text}</figcaption></figure>'


def _around(report: ScanReport) -> str:
    if report.coverage is None:
        return ""
    words = (
        "Where the pictures were taken, seen from above: the rim is level with the object's middle, "
        "the centre right above it. Red: nothing was filmed from there."
    )
    return (
        f'<figure class="small">{circle(report.coverage)}<figcaption>{words}</figcaption></figure>'
    )
