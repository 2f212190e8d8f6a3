"""Marker files of every kind say the same; what cannot be read is named with its line."""

from pathlib import Path

import numpy as np
import pytest

from omomo_core.errors import InputError
from omomo_core.learning.recordings.marker_tracks import read_places, read_tracks
from tests.core.marker_files import (
    NAMES,
    Capture,
    capture,
    write_csv,
    write_npz,
    write_places,
    write_vicon,
)


@pytest.fixture
def made() -> Capture:
    made = capture(np.random.default_rng(0), seconds=0.5)
    made.points[10:20, 2] = np.nan
    return made


def test_all_kinds_of_files_say_the_same(tmp_path: Path, made: Capture) -> None:
    places = read_places(write_places(tmp_path / "places.csv", made.places))
    np.testing.assert_allclose(places.points, made.places, rtol=1e-8)
    for file in (
        write_npz(tmp_path / "a.npz", made),
        write_csv(tmp_path / "a.csv", made),
        write_vicon(tmp_path / "b.csv", made),
    ):
        tracks = read_tracks(file).of(places)
        assert tracks.names == NAMES
        np.testing.assert_allclose(tracks.points, made.points, atol=1e-6)
        np.testing.assert_allclose(np.diff(tracks.times), np.diff(made.times), atol=1e-5)


def test_units_are_those_of_the_file_or_given(tmp_path: Path, made: Capture) -> None:
    path = write_npz(tmp_path / "a.npz", made, unit=np.array("cm"))
    np.testing.assert_allclose(read_tracks(path).points, made.points / 100)
    np.testing.assert_allclose(read_tracks(path, "mm").points, made.points / 1000)
    with pytest.raises(InputError, match="unknown-unit"):
        read_tracks(path, "ft")


def test_a_rate_will_do_for_times(tmp_path: Path, made: Capture) -> None:
    np.savez(tmp_path / "a.npz", points=made.points, names=np.array(NAMES), fps=120)
    np.testing.assert_allclose(read_tracks(tmp_path / "a.npz").times, made.times - 5.0)


TEXTS = {
    "empty": ("", ":1", "empty"),
    "no columns": ("time,a,b\n0,1,2\n", ":1", "<name>_x"),
    "half a marker": ("time,A_x,A_y\n0,1,2\n", ":1", "a_z"),
    "text": ("time,A_x,A_y,A_z\n0,1,2,3\n0.1,1,two,3\n", ":3", "text"),
    "short": ("time,A_x,A_y,A_z\n0,1,2,3\n0.1,1\n", ":3", "fewer fields"),
    "vicon cut": ("Trajectories\n120\n,,A\n", ":3", "header"),
    "vicon unit": (
        "Trajectories\n120\n,,A\nFrame,Sub Frame,X,Y,Z\n,,ft,ft,ft\n1,0,1,2,3\n",
        ":2",
        "ft",
    ),
    "vicon wide": (
        "Trajectories\n120\n,,A\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,2,3,4\n",
        ":6",
        "more fields",
    ),
}


@pytest.mark.parametrize("case", TEXTS)
def test_damaged_text_is_named_with_its_line(tmp_path: Path, case: str) -> None:
    text, line, said = TEXTS[case]
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        read_tracks(tmp_path / "a.csv")
    assert caught.value.where.endswith(f"a.csv{line}")
    assert said in caught.value.what


@pytest.mark.parametrize(
    ("times", "code"),
    [
        ([0.0, 0.1, 0.1], "markers-times"),
        ([0.0, 100, 200], "markers-rate"),
        ([0.0], "markers-short"),
    ],
)
def test_times_that_are_none_are_refused(tmp_path: Path, times: list[float], code: str) -> None:
    points = np.zeros((len(times), 1, 3))
    np.savez(tmp_path / "a.npz", points=points, names=np.array(["A"]), times=np.array(times))
    with pytest.raises(InputError) as caught:
        read_tracks(tmp_path / "a.npz")
    assert caught.value.code == code


@pytest.mark.parametrize("change", [{"points": np.zeros((3, 2))}, {"names": np.array(["A"])},
                                    {"points": np.array([None])}])  # fmt: skip
def test_arrays_that_do_not_fit_are_refused(tmp_path: Path, made: Capture, change: dict) -> None:
    path = write_npz(tmp_path / "a.npz", made, **change)
    with pytest.raises(InputError, match="markers-file"):
        read_tracks(path)
    path.write_bytes(path.read_bytes()[:50])
    with pytest.raises(InputError, match="markers-file"):
        read_tracks(path)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("x,y,z\n1,2,3\n", "markers-file"),
        ("name,x,y,z\nA,1,2\n", "markers-file"),
        ("name,x,y,z\nA,1,2,\n", "markers-file"),
        ("name,x,y,z\nA,1,2,3\nB,1,2,4\n", "markers-few"),
        ("name,x,y,z\nA,1,2,3\nA,1,2,4\nB,3,3,3\n", "marker-twice"),
    ],
)
def test_places_that_are_none_are_refused(tmp_path: Path, text: str, code: str) -> None:
    (tmp_path / "places.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        read_places(tmp_path / "places.csv")
    assert caught.value.code == code
