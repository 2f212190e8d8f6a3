"""report_page: an inspection as one HTML text, every word of the take escaped."""

from html import escape

import numpy as np

from capture_app.inspection import Inspection, Verdict
from capture_app.report_page.checks import listed
from capture_app.report_page.style import STYLE
from capture_app.report_page.svg import Band, Plot, PlotLine, draw
from ingest.report.inspect import Curve, TakeSeries, take_series
from ingest.report.take_checks import Look, Severity
from omomo_core.motion import FPS

_REST = '<span><i class="rest"></i>at rest</span>'
_FAULT = '<span><i class="fault"></i>tracking fault</span>'


def figures(series: TakeSeries) -> str:
    """Every plot of a take as <figure> elements."""
    heights = [("phone", series.phone_height)]
    if series.object_height is not None:
        heights.append(("object's lowest point", series.object_height))
    shown = [
        _over_time(series, "Speed", "m/s", [("phone", series.speed)]),
        _over_time(series, "Height above the floor", "m", heights, least=0.2),
        _map(series),
    ]
    if series.gravity is not None and len(series.gravity.seconds):
        label = "accelerometer against the poses"
        shown.append(
            _over_time(series, "Direction of gravity", "deg", [(label, series.gravity)], least=5.0)
        )
    shown.append(
        _over_time(series, "Time between poses", "ms", [("step", series.steps)], least=40.0)
    )
    return "".join(shown)


def _over_time(
    series: TakeSeries, title: str, unit: str, curves: list[tuple[str, Curve]], least: float = 0.0
) -> str:
    kinds = ("one", "two")
    lines = [
        PlotLine(curve.seconds, curve.values, kind)
        for (_, curve), kind in zip(curves, kinds, strict=False)
    ]
    bands = [Band(*span, "rest") for span in series.rests]
    bands += [Band(*span, "fault") for span in series.faults]
    plot = Plot(title, "s", unit, lines, bands, x_range=(0.0, series.seconds), least_y=least)
    words = [
        f'<span><i class="{kind}"></i>{escape(word)}</span>'
        for (word, _), kind in zip(curves, kinds, strict=False)
    ]
    words += [_REST] * bool(series.rests) + [_FAULT] * bool(series.faults)
    return _figure(title, words, plot)


def _map(series: TakeSeries) -> str:
    known = series.path[np.isfinite(series.path).all(axis=1)]
    found = [(known[0], "start"), (known[-1], "end")] if len(known) else []
    ends = [(float(place[0]), float(place[1]), word) for place, word in found]
    x, y = series.path.T
    title = "Path from above"
    plot = Plot(title, "m", "m", [PlotLine(x, y, "one")], dots=ends, height=380.0, equal=True)
    return _figure(title, [], plot)


def _figure(title: str, legend: list[str], plot: Plot) -> str:
    words = f'<p class="legend">{"".join(legend)}</p>' if legend else ""
    return f"<figure><h3>{escape(title)}</h3>{words}{draw(plot)}</figure>"


_VERDICTS: dict[Verdict, tuple[Severity, str]] = {
    "good": ("ok", "This take is good"),
    "usable with limits": ("warn", "This take is usable with limits"),
    "not usable": ("bad", "This take is not usable"),
}


def report_page(seen: Inspection) -> str:
    """The whole page; it loads nothing from anywhere."""
    name = seen.session.source.name or str(seen.session.source)
    return (
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(name)}: take report</title><style>{STYLE}</style></head><body><main>"
        f"<header><p>Take report · {escape(seen.session.app)}</p><h1>{escape(name)}</h1></header>"
        f"{_verdict(seen)}{_facts(seen)}"
        f"<h2>Checks</h2>{listed(seen.report.checks)}"
        f"{_pictures(seen)}"
        f"<footer>{escape(str(seen.session.source))}</footer></main></body></html>\n"
    )


def _pictures(seen: Inspection) -> str:
    """None where even the clock makes no sense."""
    if not seen.report.complete:
        return ""
    series = take_series(Look(seen.session, seen.mesh, seen.mount, seen.take))
    return f"<h2>What was recorded</h2>{figures(series)}"


def _verdict(seen: Inspection) -> str:
    kind, words = _VERDICTS[seen.verdict]
    paragraphs = "".join(f"<p>{escape(text)}</p>" for text in _advice(seen))
    return f'<section class="verdict {kind}"><strong>{words}</strong>{paragraphs}</section>'


def _advice(seen: Inspection) -> list[str]:
    """What the verdict rests on, and the one thing to do."""
    if seen.verdict == "good":
        return ["Nothing is to be done: run it."]
    told: list[str] = []
    if seen.problem is not None:
        told.append(seen.problem.what)
    elif seen.verdict == "usable with limits" and seen.take is not None:
        longest = max(stop - start for start, stop in seen.take.segments) / FPS
        told.append(f"A run uses its longest stretch without a fault, {longest:.1f} s.")
    return [*told, f"To do first: {seen.advice}"]


def _facts(seen: Inspection) -> str:
    times = seen.session.times
    rate = 1 / np.median(np.diff(times))
    facts = [("Length", f"{times[-1] - times[0]:.1f} s"), ("Poses a second", f"{rate:.0f}")]
    if seen.take is not None:
        spans = [(stop - start) / FPS for start, stop in seen.take.segments]
        facts.append(("Usable stretches", str(len(spans))))
        facts.append(("Longest", f"{max(spans):.1f} s"))
    facts.append(("Red, amber checks", f"{_count(seen, 'bad')}, {_count(seen, 'warn')}"))
    cells = "".join(f"<div><dt>{label}</dt><dd>{value}</dd></div>" for label, value in facts)
    return f'<dl class="facts">{cells}</dl>'


def _count(seen: Inspection, severity: Severity) -> int:
    return len(seen.report.of(severity))
