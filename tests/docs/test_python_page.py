"""docs/python.md runs as it stands, and lists exactly the names that there are."""

import re

import numpy as np
import pytest
import trimesh
from PIL import Image

import capture_app
from tests.docs import inputs
from tests.docs.pages import blocks, prose, spans

PAGE = "docs/python.md"


def test_its_blocks_run_in_their_order(given: inputs.Given, monkeypatch: pytest.MonkeyPatch):
    inputs.a_take(given.place)
    monkeypatch.chdir(given.place)
    names: dict[str, object] = {}
    for block in blocks(PAGE):
        exec(compile(block.text, f"{PAGE}:{block.line}", "exec"), names)
    assert names["rate"] == pytest.approx(58.7, abs=2)
    moved, joints = names["T_world_object"], names["joints"]
    assert isinstance(moved, np.ndarray)
    assert isinstance(joints, np.ndarray)
    assert moved.shape == (348, 4, 4)
    assert joints.shape == (348, 24, 3)
    assert len(trimesh.load_scene("chair.glb").geometry) == 2
    with Image.open("chair.png") as picture:
        assert picture.size == (320, 180)


def test_it_lists_every_name():
    rows = [line for line in prose(PAGE).splitlines() if line.startswith("| `")]
    listed = {name for row in rows for name in re.findall(r"\w+", " ".join(spans(row)))}
    listed |= set(spans(prose(PAGE)))
    assert set(capture_app.__all__) - listed == set()
    first = {name for row in rows for name in spans(row.split("|")[1])}
    assert first - set(capture_app.__all__) == set()
