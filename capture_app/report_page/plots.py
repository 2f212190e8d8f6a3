"""The pictures of a take: which curve goes where."""

from html import escape

import numpy as np

from capture_app.report_page.svg import Band, Plot, PlotLine, draw
from ingest.report.series import Curve, TakeSeries

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
