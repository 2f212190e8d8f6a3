"""Boards and markers beside the object: the size and the pose that they give, and what is refused."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from ingest.calibration.board.board_place import Tags, parse_reference
from ingest.scan.cameras.metric_scale import Similarity
from ingest.scan.cameras.reference_poses import by_reference
from ingest.scan.scan_types import View
from ingest.uncertainty import rotation
from omomo_core.errors import InputError
from tests.ingest.scan.printed import (
    BACKGROUNDS,
    CHAIR,
    lying,
    middle_of,
    painted,
    pattern_of,
    resized,
)

MODEL = Similarity(0.37, rotation(np.array([0.1, -0.05, 1.2])), np.array([3.0, -1.0, 0.5]))
"""From metres to the model, whose size is arbitrary."""
BESIDE = np.array([0.35, 0.25, -0.3])
"""From where the cameras look."""

backgrounds = pytest.mark.parametrize(
    "background",
    [
        "drawn",
        pytest.param(
            "real",
            marks=pytest.mark.skipif(not CHAIR.is_dir(), reason="the real chair is not here"),
        ),
    ],
)


def _filmed(folder: Path, background: str, prints: list[tuple[str, int, float]]) -> list[View]:
    """Views of a model of arbitrary size whose pictures show prints: text, number, degrees turned."""
    shown = BACKGROUNDS[background]()
    middle = middle_of([view for view, _ in shown])
    pictures = [picture for _, picture in shown]
    for k, (text, number, degrees) in enumerate(prints):
        reference = parse_reference(text)
        T = lying(middle + BESIDE * [1 - 2 * k, 1, 1], degrees, reference)
        pattern = pattern_of(reference, number)
        pictures = [
            painted(picture, view, T, pattern)
            for picture, (view, _) in zip(pictures, shown, strict=True)
        ]
    views: list[View] = []
    for picture, (view, _) in zip(pictures, shown, strict=True):
        file = folder / view.name
        cv2.imwrite(str(file), picture, [cv2.IMWRITE_JPEG_QUALITY, 90])
        views.append(resized(view, file, MODEL))
    return views


def _laid(views: list[View], text: str):
    return by_reference(views, parse_reference(text), lambda done: None)


@backgrounds
@pytest.mark.parametrize(
    "text",
    [
        "tag36h11:150mm",
        "tag25h9:140mm:4",
        "tag16h5:120mm:4",
        "DICT_4X4_50:120mm:4",
        "DICT_ARUCO_ORIGINAL:150mm",
        "checkerboard:6x5:30mm",
        "checkerboard:7x5:30mm",
        "checkerboard:6x6:30mm",
        "A3",
    ],
)
def test_a_print_beside_the_object_tells_size_and_up(text: str, background: str, tmp_path: Path):
    views = _filmed(tmp_path, background, [(text, 4, 25.0)])
    found, scale = _laid(views, text)
    factor = found.scale * MODEL.scale
    assert abs(factor - 1) < min(0.006, 3 * scale.sigma)
    assert scale.sigma < 0.01
    up = found.R @ MODEL.R @ [0.0, 0.0, 1.0]
    assert np.degrees(np.arccos(up[2])) < 0.6
    assert scale.by == "board"
    assert str(parse_reference(text)) in scale.description


def test_the_frame_of_a_print_is_where_it_lies(tmp_path: Path):
    text = "DICT_5X5_100:150mm:7"
    views = _filmed(tmp_path, "drawn", [(text, 7, 40.0)])
    found, _ = _laid(views, text)
    shown = BACKGROUNDS["drawn"]()
    T = lying(middle_of([v for v, _ in shown]) + BESIDE, 40.0, parse_reference(text))
    origin = found.points(MODEL.points(T[None, :3, 3]))[0]
    assert np.linalg.norm(origin) < 0.002
    x = found.R @ MODEL.R @ T[:3, 0]
    assert np.degrees(np.arccos(x[0])) < 0.6


def test_several_markers_of_one_size_are_joined(tmp_path: Path):
    views = _filmed(tmp_path, "drawn", [("tag36h11:150mm", 4, 25.0), ("tag36h11:150mm", 11, 80.0)])
    found, scale = _laid(views, "tag36h11:150mm")
    assert found.scale * MODEL.scale == pytest.approx(1, abs=0.004)
    assert "markers 4, 11" in scale.description


def test_only_the_marker_whose_side_is_stated_counts(tmp_path: Path):
    views = _filmed(tmp_path, "drawn", [("tag36h11:150mm", 4, 25.0), ("tag36h11:120mm", 11, 80.0)])
    found, _ = _laid(views, "tag36h11:120mm:11")
    assert found.scale * MODEL.scale == pytest.approx(1, abs=0.004)


def test_a_marker_that_was_moved_is_refused(tmp_path: Path):
    first = _filmed(tmp_path, "drawn", [("tag36h11:150mm", 4, 0.0)])
    (tmp_path / "later").mkdir()
    later = _filmed(tmp_path / "later", "drawn", [("tag36h11:150mm", 4, 20.0)])
    with pytest.raises(InputError, match="off their places") as caught:
        _laid([*first[:6], *later[6:]], "tag36h11:150mm")
    assert caught.value.code == "scan-board-moved"


@pytest.mark.parametrize(
    ("asked", "what", "fix"),
    [
        ("tag25h9:150mm", "marker 4 of DICT_APRILTAG_36H11", "DICT_APRILTAG_36H11:150mm"),
        (
            "tag36h11:150mm:5",
            "marker 5 of DICT_APRILTAG_36H11, but there is marker 4",
            "36H11:150mm:4",
        ),
        ("checkerboard:9x6:25mm", "0 of 12 pictures", "‹board›"),
        ("A4", "0 of 12 pictures", "‹board›"),
    ],
)
def test_what_is_there_instead_is_said(asked: str, what: str, fix: str, tmp_path: Path):
    views = _filmed(tmp_path, "drawn", [("tag36h11:150mm", 4, 25.0)])
    with pytest.raises(InputError) as caught:
        _laid(views, asked)
    assert caught.value.code == "scan-board-missing"
    assert what in caught.value.what
    assert fix in (caught.value.fix or "")


def test_nothing_is_found_where_nothing_lies(tmp_path: Path):
    views = _filmed(tmp_path, "drawn", [])
    for text in ("tag36h11:150mm", "tag16h5:100mm"):
        with pytest.raises(InputError, match="No picture shows a marker"):
            _laid(views, text)


def test_a_marker_seen_from_one_place_gives_no_size(tmp_path: Path):
    views = _filmed(tmp_path, "drawn", [("tag36h11:150mm", 4, 25.0)])
    with pytest.raises(InputError, match="from two sides"):
        _laid([views[0], replace(views[0], name="again.jpg")], "tag36h11:150mm")


@pytest.mark.parametrize(
    ("text", "code", "hint"),
    [
        ("tag36h12:80mm", "board-dictionary", "DICT_APRILTAG_36H11"),
        ("tag36h11:80", "board-text", "tag36h11:80mm"),
        ("tag36h11:80m", "board-size", "unit"),
        ("DICT_4X4_50:50mm:50", "board-number", "0 to 49"),
        ("checkerboard:2x2:25mm", "board-size", "3 x 4"),
        ("9x6:25mm", "board-text", "checkerboard:9x6:25mm"),
    ],
)
def test_what_is_no_reference_is_refused_with_advice(text: str, code: str, hint: str):
    with pytest.raises(InputError) as caught:
        parse_reference(text)
    assert caught.value.code == code
    assert hint in (caught.value.fix or "")


@pytest.mark.parametrize(
    "text", ["tag36h11:80mm", "Tag_16h5:1in:3", "checkerboard:9x6:25mm", "DICT_4X4_50:50mm:7", "A3"]
)
def test_the_text_names_the_reference(text: str):
    reference = parse_reference(text)
    assert parse_reference(str(reference)) == reference
    if isinstance(reference, Tags):
        assert reference.dictionary.startswith("DICT_")
