"""Markers give back the motion, the scale and the faults that went into them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.errors import InputError
from omomo_core.learning.recordings.marker_solve import MarkedMotion, Solving, solve
from omomo_core.learning.recordings.marker_tracks import Places, Tracks
from tests.core.marker_files import NAMES, Capture, capture

SOURCE = Path("capture.csv")


def solved(made: Capture, solving: Solving | None = None) -> MarkedMotion:
    tracks = Tracks(SOURCE, made.times, NAMES, made.points)
    return solve(tracks, Places(Path("places.csv"), NAMES, made.places), solving)


def errors(motion: MarkedMotion, made: Capture) -> tuple[float, float]:
    """Greatest distance (metres) of a corner of the object, and the scale's ratio."""
    truth = made.pose_at(motion.start + np.arange(len(motion.T_world_object)) / 30)
    corners = np.concatenate([made.places * motion.scale, np.zeros((1, 3))])
    found, want = (
        c @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
        for T, c in ((motion.T_world_object, corners), (truth, corners * made.scale / motion.scale))
    )
    return float(np.linalg.norm(found - want, axis=-1).max()), motion.scale / made.scale


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), fps=st.sampled_from([60.0, 100.0, 120.0, 240.0]))
def test_the_motion_is_given_back_at_30_fps(seed: int, fps: float) -> None:
    made = capture(np.random.default_rng(seed), seconds=1.5, fps=fps)
    motion = solved(made)
    assert motion.start == made.times[0]
    assert len(motion.T_world_object) == 46
    off, ratio = errors(motion, made)
    assert off < 1e-3  # straight lines between frames
    assert ratio == pytest.approx(1.0, abs=1e-9)
    assert motion.gaps == motion.outliers == ()


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6), yaw=st.floats(-3, 3))
def test_a_world_that_is_turned_and_moved_turns_and_moves_the_poses(seed: int, yaw: float) -> None:
    made = capture(np.random.default_rng(seed), seconds=1.2, noise=0.001)
    R = Rotation.from_euler("z", yaw).as_matrix()
    here = solved(made)
    there = solved(replace(made, points=made.points @ R.T + [1, 2, 3]))
    np.testing.assert_allclose(
        there.T_world_object[:, :3, :3], R @ here.T_world_object[:, :3, :3], atol=1e-9
    )
    np.testing.assert_allclose(
        there.T_world_object[:, :3, 3], here.T_world_object[:, :3, 3] @ R.T + [1, 2, 3], atol=1e-9
    )


def test_noise_and_badly_picked_places_cost_little() -> None:
    rng = np.random.default_rng(1)
    made = capture(rng, seconds=3.0, noise=0.0005)
    picked = replace(made, places=made.places + rng.normal(0, 0.006 / made.scale, (5, 3)))
    motion = solved(picked)
    off, ratio = errors(motion, picked)
    assert off < 0.02
    assert ratio == pytest.approx(1.0, abs=0.03)
    assert 0.002 < np.median(motion.picked_off) < 0.02
    assert motion.jitter.max() < 0.002


def test_a_marker_that_comes_and_goes_does_not_make_the_object_leap() -> None:
    rng = np.random.default_rng(2)
    made = capture(rng, seconds=3.0)
    picked = replace(made, places=made.places + rng.normal(0, 0.008 / made.scale, (5, 3)))
    whole = solved(picked)
    picked.points[60::7, 0] = np.nan
    picked.points[200:260, 3] = np.nan
    motion = solved(picked)
    assert motion.gaps == ()
    np.testing.assert_allclose(motion.T_world_object, whole.T_world_object, atol=1e-6)


def test_short_gaps_are_bridged_and_named_and_long_ones_refused() -> None:
    made = capture(np.random.default_rng(3), seconds=3.0)
    made.points[120:140, :3] = np.nan
    made.points[:30] = np.nan
    motion = solved(made)
    assert motion.start == pytest.approx(5.25)
    ends, inside = motion.gaps
    assert (ends.start, ends.end) == pytest.approx((5.0, 5.0 + 29 / 120))
    assert str(inside) == "6.00 to 6.16 s: M1, M2, M3 not seen"
    assert errors(motion, made)[0] < 0.01
    with pytest.raises(InputError) as caught:
        solved(made, Solving(bridge=0.1))
    assert caught.value.code == "markers-gap"
    assert "M1, M2, M3 not seen" in caught.value.where
    assert "5.99 to 6.17 s" in caught.value.where


def test_a_marker_that_is_mislabelled_for_a_while_is_left_out_and_named() -> None:
    made = capture(np.random.default_rng(4), seconds=2.0)
    made.points[60:90, 1] += [0.0, 0.09, 0.0]
    made.points[150:160, [2, 4]] = made.points[150:160, [4, 2]]
    motion = solved(made)
    assert errors(motion, made)[0] < 1e-3
    told = [str(span) for span in motion.outliers]
    assert told[0] == "5.50 to 5.74 s: M2 up to 9 cm off"
    assert {span.what.split()[0] for span in motion.outliers[1:]} == {"M3", "M5"}


def test_a_place_that_is_wrong_is_named() -> None:
    made = capture(np.random.default_rng(5), seconds=1.5)
    made.places[3] += 0.2 / made.scale
    with pytest.raises(InputError) as caught:
        solved(made)
    assert caught.value.code == "marker-place"
    assert "'M4'" in caught.value.what
    assert caught.value.where == "places.csv"


def of_something_else(made: Capture) -> Capture:
    return replace(made, places=np.random.default_rng(0).normal(size=(5, 3)))


def in_line(made: Capture) -> Capture:
    return replace(made, places=np.outer(np.arange(5.0), [1, 0, 0]))


def in_millimetres(made: Capture) -> Capture:
    return replace(made, points=made.points * 1000)


def unseen(made: Capture) -> Capture:
    return replace(made, points=np.where(np.arange(5)[:, None] < 3, np.nan, made.points))


def brief(made: Capture) -> Capture:
    return replace(made, times=made.times[:60], points=made.points[:60])


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (of_something_else, "markers-do-not-fit"),
        (in_line, "markers-in-line"),
        (in_millimetres, "markers-units"),
        (unseen, "markers-unseen"),
        (brief, "markers-gap"),
    ],
)
def test_what_cannot_give_a_motion_is_refused(spoil, code: str) -> None:
    with pytest.raises(InputError) as caught:
        solved(spoil(capture(np.random.default_rng(6))))
    assert caught.value.code == code
    assert caught.value.fix


def test_markers_are_found_by_name_among_others() -> None:
    made = capture(np.random.default_rng(7))
    names = ("Chair:M2", "LFHD", "Chair:M1", "Box:M3")
    tracks = Tracks(SOURCE, made.times, names, made.points[:, :4])
    places = Places(SOURCE, ("M1", "Box:M3", "M2"), made.places[:3])
    assert tracks.of(places).names == places.names
    np.testing.assert_array_equal(tracks.of(places).points, made.points[:, [2, 3, 0]])
    with pytest.raises(InputError, match="0 tracks are of marker 'M9'"):
        tracks.of(Places(SOURCE, ("M9",), made.places[:1]))
    twice = replace(tracks, names=("A:M1", "B:M1", "x", "y"))
    with pytest.raises(InputError, match="marker-twice"):
        twice.of(Places(SOURCE, ("M1",), made.places[:1]))
