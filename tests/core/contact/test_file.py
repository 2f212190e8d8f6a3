"""contacts.json: what is written is read, and each contradiction is named."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.contact.contact_file import read_contacts, write_contacts
from omomo_core.contact.segment import ContactSegment, ContactSpan
from omomo_core.errors import InputError
from tests.core.contact.box import FRAMES, LEFT, SURFACE

Entry = dict[str, object]
GOOD: Entry = {"hand": "left", "start": 12, "stop": 60, "anchor": LEFT.tolist()}


@given(seed=st.integers(0, 10_000), count=st.integers(0, 6))
@settings(max_examples=25)
def test_round_trip(tmp_path_factory: pytest.TempPathFactory, seed: int, count: int):
    rng = np.random.default_rng(seed)
    rows = rng.integers(len(SURFACE.points), size=count)
    anchors = SURFACE.points[rows] + 0.02 * SURFACE.normals[rows]
    segments = [ContactSegment(k % 2, 15 * k, 15 * k + 10, a) for k, a in enumerate(anchors)]
    path = tmp_path_factory.mktemp("contacts") / "contacts.json"
    write_contacts(path, segments[::-1], FRAMES)
    back = read_contacts(path, FRAMES, SURFACE)
    assert len(back) == count
    for s, b in zip(segments, back, strict=True):
        assert isinstance(b, ContactSegment)
        assert (s.hand, s.start, s.stop) == (b.hand, b.start, b.stop)
        np.testing.assert_allclose(b.anchor, s.anchor, atol=1e-5)


def test_one_segment_is_one_line(tmp_path: Path):
    path = tmp_path / "contacts.json"
    write_contacts(path, [ContactSegment(0, 12, 60, LEFT), ContactSegment(1, 3, 9, -LEFT)], FRAMES)
    assert path.read_text().splitlines()[4:7] == [
        '  "segments": [',
        '    {"hand": "right", "start": 3, "stop": 9, "anchor": [0.24, -0.05, -0.0]},',
        '    {"hand": "left", "start": 12, "stop": 60, "anchor": [-0.24, 0.05, 0.0]}',
    ]


def read(tmp_path: Path, *entries: object, **other: object) -> tuple[ContactSpan, ...]:
    path = tmp_path / "contacts.json"
    data = {"version": 1, "fps": 30, "frames": FRAMES, "segments": list(entries), **other}
    path.write_text(json.dumps(data))
    return read_contacts(path, FRAMES, SURFACE)


def error(tmp_path: Path, *entries: object, **other: object) -> InputError:
    with pytest.raises(InputError) as caught:
        read(tmp_path, *entries, **other)
    return caught.value


def test_an_anchor_may_be_left_out(tmp_path: Path):
    bare = {key: GOOD[key] for key in ("hand", "start", "stop")}
    again = {**GOOD, "start": 66, "stop": FRAMES, "anchor": None}
    assert read(tmp_path, bare, again) == (ContactSpan(0, 12, 60), ContactSpan(0, 66, FRAMES))


@pytest.mark.parametrize(
    ("code", "change", "said"),
    [
        ("contacts-hand", {"hand": "both"}, "'both'"),
        ("contacts-hand", {"hand": 0}, "0"),
        ("contacts-range", {"start": 12.5}, "start is 12.5"),
        ("contacts-range", {"start": True}, "start is True"),
        ("contacts-range", {"start": "12"}, "start is '12'"),
        ("contacts-range", {"start": -1}, "start is -1"),
        ("contacts-range", {"stop": FRAMES + 1}, "stop is 91"),
        ("contacts-range", {"stop": 12}, "starts at frame 12 and stops at frame 12"),
        ("contacts-anchor", {"anchor": [0.24, 0.0]}, "[0.24, 0.0]"),
        ("contacts-anchor", {"anchor": "side"}, "'side'"),
        ("contacts-anchor", {"anchor": [0.24, 0.0, float("nan")]}, "nan"),
        ("contacts-anchor", {"anchor": [0.24, 0.0, 10**400]}, "not three finite numbers"),
        ("contacts-anchor", {"anchor": [0.24, 0.0, [0]]}, "[0]"),
        ("contacts-off-surface", {"anchor": [0.24, 0.0, 0.45]}, "0.25"),
        ("contacts-off-surface", {"anchor": [240, 0, 0]}, "240 m"),
        ("contacts-keys", {"ancor": None}, "'ancor' is not known"),
    ],
)
def test_each_contradiction_says_what_and_where(
    tmp_path: Path, code: str, change: Entry, said: str
):
    good = {**GOOD, "hand": "right"}
    problem = error(tmp_path, good, {**GOOD, **change})
    assert problem.code == code
    assert said in problem.what
    assert problem.where == f"{tmp_path / 'contacts.json'}, segments[1]"
    assert problem.fix


def test_a_hand_is_not_in_two_places(tmp_path: Path):
    later = {**GOOD, "start": 59, "stop": 80}
    problem = error(tmp_path, later, {**GOOD, "hand": "right"}, GOOD)
    assert problem.code == "contacts-overlap"
    assert "left hand holds two places from frame 59 on" in problem.what
    assert problem.where.endswith("contacts.json, segments[2] and segments[0]")


def test_a_hand_needs_time_to_go_from_place_to_place(tmp_path: Path):
    problem = error(tmp_path, GOOD, {**GOOD, "start": GOOD["stop"], "stop": GOOD["stop"] + 10})
    assert problem.code == "contacts-travel"
    assert problem.where.endswith("contacts.json, segments[0] and segments[1]")


def test_the_whole_must_fit_the_take(tmp_path: Path):
    assert error(tmp_path, GOOD, frames=80).code == "contacts-frames"
    assert error(tmp_path, GOOD, fps=60).code == "contacts-frames"
    assert error(tmp_path, GOOD, version=2).code == "contacts-version"
    assert error(tmp_path, GOOD, other=1).code == "contacts-keys"
    assert error(tmp_path, GOOD, segments={}).code == "contacts-unreadable"
    assert error(tmp_path, [GOOD]).code == "contacts-keys"
    assert error(tmp_path, {"hand": "left", "stop": 3}).what == "'start' is missing."


def test_what_is_no_contacts_file(tmp_path: Path):
    path = tmp_path / "contacts.json"
    with pytest.raises(InputError) as caught:
        read_contacts(path, FRAMES, SURFACE)
    assert caught.value.code == "contacts-missing"
    for raw in (b"", b"{", b"\xff\xfe", b"[1]", b"[" * 100_000, b'{"version": ' + b"9" * 9999):
        path.write_bytes(raw)
        with pytest.raises(InputError) as caught:
            read_contacts(path, FRAMES, SURFACE)
        assert caught.value.code == "contacts-unreadable"
        assert "Write them like this" in caught.value.fix
