"""The report shows what was counted: JSON, table, and a figure whose bars are as long as the shares."""

import json
from pathlib import Path
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest

from capture_app.study.study_design import Plan
from capture_app.study.study_report import analyse, write_report
from omomo_core.errors import InputError

from .conftest import Crowd, make_key


def test_json_table_and_figure_agree(crowd: Crowd, tmp_path: Path) -> None:
    key = make_key(Plan(raters=12, pairs=10))
    found = analyse(key, crowd.vote(key, np.random.default_rng(5)))
    out = tmp_path / "found"
    write_report(out, key, found)
    data = json.loads((out / "analysis.json").read_text())
    text = (out / "table.md").read_text()
    svg = fromstring((out / "figure.svg").read_text())
    boxes = [e for e in svg.iter() if e.tag.endswith("rect") and e.get("fill") == "#3f6fae"]
    assert len(data["preferences"]) == len(boxes) == 3
    for row, box in zip(data["preferences"], boxes, strict=True):
        share = row["share_first"]
        assert row["low"] < share < row["high"]
        assert float(box.get("width")) == pytest.approx(700 * share, abs=0.1)
        assert f"| {share:.1%} |" in text
    assert {r["votes"] for r in data["raters_left_out"]} == {n for n, _ in found.left_out}
    assert all(name in text for name, _ in found.left_out)
    assert len(data["raters_counted"]) + len(data["raters_left_out"]) == len(key.pages)


def test_an_earlier_report_is_kept(crowd: Crowd, tmp_path: Path) -> None:
    key = make_key(Plan(raters=2, pairs=2))
    found = analyse(key, crowd.vote(key, np.random.default_rng(5)))
    with pytest.raises(InputError) as caught:
        write_report(tmp_path, key, found)
    assert caught.value.code == "output-exists"
    assert list(tmp_path.iterdir()) == []
