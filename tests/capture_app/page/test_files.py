"""Rules that keep the page offline, safe and small."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).resolve().parents[3] / "capture_app" / "web" / "page"
SCRIPTS = sorted(PAGE.rglob("*.js"))


def test_document_has_nothing_inline():
    text = (PAGE / "index.html").read_text()
    assert not re.search(r"<style|\sstyle=|\son\w+=|javascript:", text)
    assert re.findall(r"<script([^>]*)>([^<]*)", text) == [
        (' type="module" src="/static/app.js"', "")
    ]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.relative_to(PAGE).as_posix())
def test_script_is_small_and_loads_only_ours(script):
    text = script.read_text()
    assert len(text.splitlines()) < 300
    assert not re.search(r"innerHTML|insertAdjacentHTML|document\.write|\beval\(", text)
    for target in re.findall(r'from "(\.[^"]+)"', text):
        assert (script.parent / target).is_file(), target
    for url in re.findall(r"https?://[^\s\"']+", text):
        assert url.startswith("http://www.w3.org/"), url
