"""`omocap formats` tells what can be read."""

import json

import pytest

from capture_app.cli.app import invoke
from ingest.formats.registry import FORMATS


@pytest.mark.runs("formats")
def test_every_format_is_shown(capsys: pytest.CaptureFixture[str]):
    assert invoke(["formats"]) == 0
    shown = capsys.readouterr().out
    words = shown.split()
    for format_ in FORMATS:
        assert set(format_.NAME.split()) <= set(words)
        assert set(format_.FILES.split()) <= set(words)
        assert set(format_.LACKS.split()) <= set(words)
    assert ".zip" in shown


def test_as_json(capsys: pytest.CaptureFixture[str]):
    assert invoke(["formats", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == [format_.NAME for format_ in FORMATS]
    assert rows[0] == {
        "name": "Stray Scanner",
        "files": "a folder with odometry.csv",
        "lacks": "no tracking state; needs LiDAR",
    }
