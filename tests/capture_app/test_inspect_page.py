"""The take report as a page: whole, safe, and telling what the checks found."""

import json
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_app.cli.app import invoke
from capture_app.inspection import inspect_take
from capture_app.report_page import Plot, PlotLine, draw, report_page, ticks
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from omomo_core.errors import InputError
from omomo_core.whole_file import write_whole
from tests.ingest import good_take as go

HOSTILE = '<img src=x onerror="alert(1)">&amp;\'"</title>'
VOID = {"meta", "path", "rect", "circle"}


class Reader(HTMLParser):
    """Collects tags and words, and checks that what is opened is closed."""

    def __init__(self, text: str):
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.words = ""
        self.open: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words += data


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> go.Take:
    folder = tmp_path_factory.mktemp("take") / HOSTILE.replace("/", "_")
    folder.mkdir()
    return go.make_take(folder, go.make_session())


def test_the_shipped_take_is_good_and_shown_whole():
    seen = inspect_take(DEMO / SESSION, DEMO / MESH, DEMO / MOUNT)
    page = Reader(report_page(seen))
    assert "This take is good" in page.words
    for check in seen.report.checks:
        assert check.name.capitalize() in page.words
        assert check.message in page.words
    assert page.tags.count("svg") == 5
    for title in ("Speed", "Height above the floor", "Path from above", "Direction of gravity"):
        assert title in page.words


def test_it_loads_nothing_and_hostile_names_stay_words(take: go.Take):
    take.write(go.jumped(take.good, (0.4, 0, 0)))
    seen = take.inspect()
    text = report_page(seen)
    page = Reader(text)
    assert "onerror" in page.words
    assert not {"img", "script", "link", "iframe", "object"} & set(page.tags)
    names = {name for name, _ in page.attributes}
    assert not {"src", "href", "style"} & names
    assert not any(name.startswith("on") for name in names)
    assert "url(" not in text
    assert "@import" not in text
    assert "usable with limits" in page.words
    jump = next(c for c in seen.report.checks if c.name == "tracking jump")
    assert jump.frames is not None
    assert f"poses {jump.frames[0]} to {jump.frames[1] - 1}" in page.words
    assert f"Do: {jump.fix}" in page.words
    assert ("class", "fault") in page.attributes


@pytest.mark.parametrize(
    "corrupt",
    [
        lambda s: go.timed(s, s.times * 1e3),
        lambda s: go.at_rate(s, 5),
        lambda s: go.turned_world(s, "x", 90),
        lambda s: go.held(s, 2, len(s.times)),
    ],
    ids=["milliseconds", "five a second", "lying", "frozen"],
)
def test_an_unusable_take_has_a_page_too(take: go.Take, corrupt):
    take.write(corrupt(take.good))
    seen = take.inspect()
    page = Reader(report_page(seen))
    assert "This take is not usable" in page.words
    assert f"To do first: {seen.advice}" in page.words
    assert seen.advice


def test_the_command_writes_it_and_tells_the_verdict(
    take: go.Take, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    take.write(take.good)
    page = tmp_path / "report.html"
    inputs = [str(take.session), "--object", str(take.mesh), "--mount", str(take.mount)]
    assert invoke(["inspect", *inputs, "--html", str(page), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["verdict"] == "good"
    assert report["usable"]
    assert page.read_text("utf-8").startswith("<!DOCTYPE html>")
    take.write(go.placed(take.good, lambda p: p / 3))
    assert invoke(["inspect", *inputs, "--html", str(page)]) == 2
    printed = capsys.readouterr()
    assert "Verdict: not usable" in printed.out
    assert "code: take-bad" in printed.err
    assert "Scale: a metre of the poses" in printed.err
    assert "This take is not usable" in page.read_text("utf-8")
    assert invoke(["inspect", *inputs, "--json"]) == 2
    report = json.loads(capsys.readouterr().out)
    assert report["severity"] == "bad"
    assert "take-bad" in report["problem"]


def test_a_page_that_cannot_be_written_leaves_the_old_one(tmp_path: Path):
    page = tmp_path / "report.html"
    write_whole(page, "one")
    with pytest.raises(UnicodeEncodeError):
        write_whole(page, "two \ud800")
    assert page.read_text() == "one"
    write_whole(page, "three")
    assert page.read_text() == "three"
    with pytest.raises(InputError) as caught:
        write_whole(tmp_path / "no" / "report.html", "four")
    assert caught.value.code == "output-not-writable"
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]


@settings(max_examples=30)
@given(
    low=st.floats(-1e6, 1e6, allow_nan=False),
    span=st.floats(1e-3, 1e6, allow_nan=False),
)
def test_ticks_are_few_even_and_inside(low: float, span: float):
    found = ticks(low, low + span)
    assert 2 <= len(found) <= 7
    assert low - 1e-6 * span <= found[0]
    assert found[-1] <= low + span * (1 + 1e-6)
    steps = np.diff(found)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-6)
    leading = float(steps.mean()) / 10.0 ** np.floor(np.log10(steps.mean()) + 1e-4)
    assert min(abs(leading - k) for k in (1, 2, 5)) < 1e-3


def test_curves_break_at_nan_stay_inside_and_words_are_escaped():
    x = np.linspace(0, 10, 200)
    y = np.sin(x)
    y[80:90] = np.nan
    text = draw(Plot("<b>&", "s<", "m", [PlotLine(x, y, "one")], dots=[(5.0, 0.5, "<i>")]))
    page = Reader(text)
    assert not {"b", "i"} & set(page.tags)
    path = next(value for name, value in page.attributes if name == "d" and value.count("L") > 50)
    strokes = [stroke.split("L") for stroke in path.split("M")[1:]]
    assert [len(stroke) for stroke in strokes] == [80, 110]
    points = np.array([list(map(float, p.split())) for stroke in strokes for p in stroke])
    assert (points >= 0).all()
    assert (points <= [720, 200]).all()
    # Up is up: the largest value is the smallest pixel.
    assert np.argmax(y[np.isfinite(y)]) == np.argmin(points[:, 1])


@pytest.mark.parametrize("height", [1e8, -1e20, 1e300])
def test_a_curve_of_absurd_height_is_drawn_all_the_same(height: float):
    times = np.arange(5.0)
    heights = height + np.linspace(0, 0.3, 5)
    drawn = draw(Plot("Height", "s", "m", [PlotLine(times, heights, "one")], least_y=0.2))
    assert "nan" not in drawn
    assert "inf" not in drawn
