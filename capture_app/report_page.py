"""The page of `omocap inspect --html`: one HTML text with its style and plots."""

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

import cv2
import numpy as np
from jaxtyping import Float64, UInt8

from capture_app.inspection import Inspection, Verdict
from ingest.report.checked_session import CheckedSession
from ingest.report.take_inspection import Curve, TakeSeries, take_series
from ingest.report.take_report import Check, Severity
from omomo_core.motion import FPS

WORDS: dict[Severity, str] = {"ok": "✓ good", "warn": "! look", "bad": "✕ bad"}


def listed(checks: Sequence[Check]) -> str:
    """The worst first and open, those that are well folded up below."""
    troubles = [_item(c) for kind in ("bad", "warn") for c in checks if c.severity == kind]
    well = [_item(check) for check in checks if check.severity == "ok"]
    shown = f'<ul class="checks">{"".join(troubles)}</ul>' if troubles else ""
    return (
        f"{shown}<details><summary>{WORDS['ok']}: {len(well)} checks</summary>"
        f'<ul class="checks">{"".join(well)}</ul></details>'
    )


def _item(check: Check) -> str:
    where = ""
    if check.frames is not None:
        first, last = check.frames[0], check.frames[1] - 1
        where = f' <span class="where">poses {first} to {last}</span>'
    fix = f'<span class="fix"><b>Do:</b> {escape(check.fix)}</span>' if check.fix else ""
    return (
        f'<li><span class="badge {check.severity}">{WORDS[check.severity]}</span>'
        f'<span class="name">{escape(check.name.capitalize())}</span>'
        f'<span class="what">{escape(check.message)}{where}{fix}</span></li>'
    )


STYLE = """
:root { color-scheme: light dark;
  --paper:#fbfaf8; --card:#ffffff; --ink:#1c1d21; --quiet:#6a6c75; --hair:#e4e2dd; --grid:#eeece7;
  --ok:#1d7a4c; --ok-soft:#e5f3ea; --warn:#9a6200; --warn-soft:#fdf0d5; --bad:#b3261e;
  --bad-soft:#fbe4e1; --one:#2b5fd0; --two:#c2571a; --rest:#dcebe0; }
@media (prefers-color-scheme: dark) { :root {
  --paper:#131417; --card:#1b1d21; --ink:#ececee; --quiet:#9c9fa9; --hair:#2c2f35; --grid:#25282d;
  --ok:#6cce97; --ok-soft:#1b3427; --warn:#f0b955; --warn-soft:#3a2d12; --bad:#ff8f85;
  --bad-soft:#44201d; --one:#82a7ff; --two:#ff9f68; --rest:#213328; } }
* { box-sizing:border-box; }
body { margin:0; background:var(--paper); color:var(--ink); -webkit-text-size-adjust:100%;
  font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",sans-serif; }
main { max-width:58rem; margin:0 auto; padding:2.5rem 1.25rem 4rem; }
header p { margin:0; color:var(--quiet); font-size:.9rem; overflow-wrap:anywhere; }
h1 { margin:.2rem 0 0; font-size:1.05rem; font-weight:600; overflow-wrap:anywhere; }
h2 { margin:2.75rem 0 .9rem; font-size:1.15rem; font-weight:650; letter-spacing:-.01em; }
h3 { margin:0 0 .5rem; font-size:.95rem; font-weight:600; }
.verdict { margin:1.4rem 0 0; padding:1.25rem 1.4rem; border-radius:14px; }
.verdict strong { display:block; font-size:1.6rem; line-height:1.25; letter-spacing:-.02em; }
.verdict p { margin:.45rem 0 0; max-width:44rem; color:var(--ink); }
.verdict.ok { background:var(--ok-soft); } .verdict.ok strong { color:var(--ok); }
.verdict.warn { background:var(--warn-soft); } .verdict.warn strong { color:var(--warn); }
.verdict.bad { background:var(--bad-soft); } .verdict.bad strong { color:var(--bad); }
.facts { display:grid; grid-template-columns:repeat(auto-fit,minmax(8.5rem,1fr)); gap:.75rem;
  margin:1.25rem 0 0; padding:0; }
.facts div { padding:.7rem .9rem; background:var(--card); border:1px solid var(--hair);
  border-radius:12px; }
.facts dt { color:var(--quiet); font-size:.78rem; }
.facts dd { margin:0; font-size:1.2rem; font-weight:600; font-variant-numeric:tabular-nums; }
.checks { list-style:none; margin:0; padding:0; background:var(--card); overflow:hidden;
  border:1px solid var(--hair); border-radius:14px; }
.checks li { display:grid; grid-template-columns:6.2rem 11rem 1fr; gap:.15rem 1rem;
  padding:.7rem 1.1rem; }
.checks li + li { border-top:1px solid var(--hair); }
details { margin-top:.8rem; }
summary { cursor:pointer; padding:.3rem .2rem; color:var(--ok); font-weight:600; font-size:.92rem; }
details[open] summary { margin-bottom:.5rem; }
.name { font-weight:600; }
.what { overflow-wrap:anywhere; }
.where { color:var(--quiet); white-space:nowrap; font-size:.88rem; }
.fix { display:block; margin-top:.2rem; }
.fix b { font-weight:600; }
.badge { justify-self:start; align-self:start; padding:.1rem .6rem .12rem; border-radius:99px;
  font-size:.82rem; font-weight:600; white-space:nowrap; }
.badge.ok { background:var(--ok-soft); color:var(--ok); }
.badge.warn { background:var(--warn-soft); color:var(--warn); }
.badge.bad { background:var(--bad-soft); color:var(--bad); }
figure { margin:0 0 1.1rem; padding:1rem 1.1rem .6rem; background:var(--card);
  border:1px solid var(--hair); border-radius:14px; }
svg { display:block; width:100%; height:auto; }
.legend { display:flex; flex-wrap:wrap; gap:.2rem 1.1rem; margin:0 0 .4rem; color:var(--quiet);
  font-size:.84rem; }
.legend i { display:inline-block; width:1.1rem; height:.24rem; margin-right:.4rem;
  vertical-align:middle; border-radius:2px; background:var(--one); }
.legend i.two { background:var(--two); }
.legend i.rest { height:.8rem; background:var(--rest); }
.legend i.fault { height:.8rem; background:var(--bad); opacity:.35; }
text { font-family:inherit; fill:var(--quiet); font-size:12.5px;
  font-variant-numeric:tabular-nums; }
text.label { fill:var(--ink); }
.grid { stroke:var(--grid); } .axis, .tick { stroke:var(--quiet); fill:none; }
.line { fill:none; stroke:var(--one); stroke-width:1.7; stroke-linejoin:round; }
.line.two { stroke:var(--two); }
.dot { fill:var(--card); stroke:var(--one); stroke-width:2.2; }
rect.rest { fill:var(--rest); } rect.fault { fill:var(--bad); opacity:.35; }
footer { margin-top:2.5rem; color:var(--quiet); font-size:.85rem; }
@media (max-width:40rem) {
  main { padding:1.5rem .9rem 3rem; }
  .checks li { grid-template-columns:auto 1fr; padding:.8rem .9rem; }
  .checks .what { grid-column:1 / -1; }
  figure { padding:.8rem .6rem .4rem; }
  text { font-size:19px; } .number { font-size:17px; }
  .line { stroke-width:2.6; }
}
@media print { body { background:#fff; } figure, .checks li { break-inside:avoid; } }
"""


@dataclass(frozen=True)
class ReportPage:
    """A report on a take or a scan: the verdict, numbers, and sections of HTML."""

    kind: str
    """What it is, such as "Take report"."""
    name: str
    """What it is about."""
    verdict: Severity
    headline: str
    advice: Sequence[str]
    """What the verdict rests on, and what to do first; a paragraph each."""
    facts: Sequence[tuple[str, str]]
    """Labels and values."""
    sections: Sequence[tuple[str, str]]
    """Headings, and the HTML below them."""
    source: str
    app: str = ""
    """The app that recorded it, if that is to be said."""
    style: str = ""
    """Rules beside those of every report."""

    def html(self) -> str:
        """Return the whole page, with every word of the user escaped; it loads nothing from anywhere."""
        name, app = escape(self.name), f" · {escape(self.app)}" if self.app else ""
        advice = "".join(f"<p>{escape(text)}</p>" for text in self.advice)
        facts = "".join(
            f"<div><dt>{label}</dt><dd>{value}</dd></div>" for label, value in self.facts
        )
        sections = "".join(f"<h2>{heading}</h2>{part}" for heading, part in self.sections)
        return (
            '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{name}: {self.kind.lower()}</title><style>{STYLE}{self.style}</style></head>"
            f"<body><main><header><p>{self.kind}{app}</p><h1>{name}</h1></header>"
            f'<section class="verdict {self.verdict}"><strong>{self.headline}</strong>{advice}'
            f'</section><dl class="facts">{facts}</dl>{sections}'
            f"<footer>{escape(self.source)}</footer></main></body></html>\n"
        )


_WIDTH, _LEFT, _RIGHT, _TOP, _BOTTOM = 720.0, 48.0, 14.0, 26.0, 28.0
_MAX_POINTS = 1500
"""Most points of a curve: more than the pixels of a screen are not seen."""
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
    """The mapping from data to pixels."""

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
    """Return the range of the finite values with a little room; it reaches zero where that is near."""
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
    places = [(known[0], "start"), (known[-1], "end")] if len(known) else []
    ends = [(float(place[0]), float(place[1]), word) for place, word in places]
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


def figure(words: str, picture: UInt8[np.ndarray, "h w 3"]) -> str:
    """HTML of a picture with a caption, which loads nothing from anywhere."""
    bgr = cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
    data = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()
    source = f"data:image/jpeg;base64,{b64encode(data).decode()}"
    text = escape(words)
    return f'<figure><img src="{source}" alt="{text}"><figcaption>{text}</figcaption></figure>'


_QUALITY = 88
"""JPEG quality of pictures."""
PICTURE_WORDS = (
    "The phone on the object when the take begins, in mid-motion and when it ends. The dots are the object's "
    "way over the floor. A wrong mesh or mount shows here."
)


def report_page(inspection: Inspection, picture: UInt8[np.ndarray, "h w 3"] | None = None) -> str:
    """The page about a take.

    Args:
        inspection: of the take.
        picture: of the object with the phone on it, if it is drawn.
    """
    verdict, headline = _VERDICTS[inspection.verdict]
    return ReportPage(
        kind="Take report",
        app=inspection.session.app,
        name=inspection.session.source.name or str(inspection.session.source),
        verdict=verdict,
        headline=headline,
        advice=_advice(inspection),
        facts=_facts(inspection),
        sections=[
            *(
                []
                if picture is None
                else [("The object and the phone", figure(PICTURE_WORDS, picture))]
            ),
            ("Checks", listed(inspection.report.checks)),
            *_recorded(inspection),
        ],
        style="figure img { max-width:100%; }",
        source=str(inspection.session.source),
    ).html()


def _recorded(inspection: Inspection) -> list[tuple[str, str]]:
    """The section with the plots; none where even the clock makes no sense."""
    if not inspection.report.complete:
        return []
    series = take_series(
        CheckedSession(inspection.session, inspection.mesh, inspection.mount, inspection.take)
    )
    return [("What was recorded", figures(series))]


def _advice(inspection: Inspection) -> list[str]:
    """Return what the verdict rests on, and the one thing to do."""
    if inspection.verdict == "good":
        return ["Nothing is to be done: run it."]
    sentences: list[str] = []
    if inspection.problem is not None:
        sentences.append(inspection.problem.what)
    elif inspection.verdict == "usable with limits" and inspection.take is not None:
        longest = max(stop - start for start, stop in inspection.take.segments) / FPS
        sentences.append(f"A run uses its longest stretch without a fault, {longest:.1f} s.")
    return [*sentences, f"To do first: {inspection.advice}"]


def _facts(inspection: Inspection) -> list[tuple[str, str]]:
    times = inspection.session.times
    rate = 1 / np.median(np.diff(times))
    facts = [("Length", f"{times[-1] - times[0]:.1f} s"), ("Poses a second", f"{rate:.0f}")]
    if inspection.take is not None:
        spans = [(stop - start) / FPS for start, stop in inspection.take.segments]
        facts.append(("Usable stretches", str(len(spans))))
        facts.append(("Longest", f"{max(spans):.1f} s"))
    red, amber = (len(inspection.report.of(severity)) for severity in ("bad", "warn"))
    return [*facts, ("Red, amber checks", f"{red}, {amber}")]
