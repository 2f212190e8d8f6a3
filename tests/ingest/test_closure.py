"""Drift over a take that ends on the mark where it began: measured always, spread on request."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.axes import T_ZUP_ARKIT
from ingest.mount import identity_mount
from ingest.session import CaptureSession
from ingest.trajectory.closure import find_closure, spread
from ingest.trajectory.object_motion import to_object_motion
from ingest.trajectory.trajectory_config import Reading
from omomo_core.errors import InputError
from omomo_core.geometry.runs import min_jerk
from omomo_core.motion import FPS


def _round_trip(seed: int, seconds: float = 10.0) -> np.ndarray:
    """Poses z up at 30 fps: at rest on a mark for a second, a loop, at rest on it again."""
    rng = np.random.default_rng(seed)
    s = min_jerk((np.arange(int(seconds * FPS)) / FPS - 1) / (seconds - 2))
    swing = np.sin(np.pi * s) ** 2
    T = np.tile(np.eye(4), (len(s), 1, 1))
    T[:, :3, 3] = rng.uniform(-2, 2, 3) + swing[:, None] * rng.uniform(-1.5, 1.5, 3)
    T[:, 0, 3] += np.sin(2 * np.pi * s) * 0.6
    angles = np.stack([rng.uniform(-3, 3) + 2 * np.sin(2 * np.pi * s), 0.4 * swing], axis=1)
    T[:, :3, :3] = Rotation.from_euler("zx", angles).as_matrix()
    T[:, :3, 3] += rng.normal(scale=2e-4, size=(len(T), 3))
    return T


def _drifted(T: np.ndarray, seed: int) -> np.ndarray:
    """The same seen by a tracker whose place and heading walk off along the path."""
    rng = np.random.default_rng(seed + 1)
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1))])
    # What shakes at rest is no path.
    progress = (np.clip(length, length[30], length[-31]) - length[30]) / np.ptp(length[30:-30])
    out = T.copy()
    turns = Rotation.from_rotvec(np.outer(progress, [0, 0, rng.uniform(-0.1, 0.1)])).as_matrix()
    out[:, :3, :3] = turns @ T[:, :3, :3]
    moved = np.einsum("nij,nj->ni", turns[1:], np.diff(T[:, :3, 3], axis=0))
    out[1:, :3, 3] = T[0, :3, 3] + np.cumsum(moved, axis=0)
    out[:, :3, 3] += progress[:, None] * rng.uniform(-0.04, 0.04, 3)
    return out


def _all(T: np.ndarray) -> np.ndarray:
    return np.ones(len(T), bool)


@settings(max_examples=25)
@example(seed=756)
@given(seed=st.integers(0, 10**6))
def test_ends_meet_and_the_truth_comes_nearer(seed: int):
    true = _round_trip(seed)
    seen = _drifted(true, seed)
    closure = find_closure(seen, _all(seen))
    assert closure is not None
    again = spread(seen, closure, "")
    left = find_closure(again, _all(again))
    assert left is not None
    # A rest that is found a frame longer has its middle elsewhere by a hair.
    same = (left.first, left.last) == (closure.first, closure.last)
    assert left.translation < (1e-9 if same else 1e-4)
    assert left.rotation < 1e-3  # the drift has no tilt
    # The start is untouched, and the drift is the one that was put in.
    start = slice(0, closure.first[1] - 1)
    np.testing.assert_allclose(again[start], seen[start], rtol=0, atol=1e-12)
    np.testing.assert_allclose(again[:, :3, 3], true[:, :3, 3], atol=0.012)
    np.testing.assert_allclose(again[:, :3, :3], true[:, :3, :3], atol=0.012)


@settings(max_examples=25)
@given(seed=st.integers(0, 10**6))
def test_it_is_smooth_and_keeps_gravity(seed: int):
    seen = _drifted(_round_trip(seed), seed)
    closure = find_closure(seen, _all(seen))
    assert closure is not None
    again = spread(seen, closure, "")
    # Tilt is gravity's: each frame keeps the height of its axes.
    np.testing.assert_allclose(again[:, 2, :3], seen[:, 2, :3], atol=1e-12)
    # No step changes by more than its part of the path, be it for the shift or for the turn.
    steps = [np.linalg.norm(np.diff(x[:, :3, 3], axis=0), axis=1) for x in (seen, again)]
    part = (closure.translation + np.radians(closure.rotation) * closure.path) / closure.path
    assert (np.abs(steps[1] - steps[0]) <= 1.01 * part * steps[0] + 1e-5).all()


def test_without_drift_nothing_moves():
    T = _round_trip(4)
    T[:31], T[-31:] = T[0], T[0]
    closure = find_closure(T, _all(T))
    assert closure is not None
    assert closure.translation < 3e-4
    assert closure.rotation < 0.05
    assert closure.seconds == pytest.approx(8.0, abs=1.0)
    np.testing.assert_allclose(spread(T, closure, ""), T, atol=5e-4)


def test_an_object_turned_on_the_spot_has_a_closure_too():
    T = np.tile(np.eye(4), (240, 1, 1))
    turn = 6.5 * min_jerk((np.arange(240) - 60) / 120)
    T[:, :3, :3] = Rotation.from_euler("z", turn[:, None]).as_matrix()
    closure = find_closure(T, _all(T))
    assert closure is not None
    again = spread(T, closure, "")
    # 6.5 rad are 0.217 more than a whole turn.
    assert closure.rotation == pytest.approx(np.degrees(6.5 - 2 * np.pi), abs=0.1)
    np.testing.assert_allclose(again[-1], again[0], atol=2e-3)


def test_no_closure_without_rests_at_both_ends():
    T = _round_trip(5, 30.0)
    assert find_closure(T[100:], _all(T[100:])) is None
    assert find_closure(T[:-100], _all(T[:-100])) is None
    assert find_closure(np.tile(np.eye(4), (200, 1, 1)), np.ones(200, bool)) is None


def _session(T_zup: np.ndarray) -> CaptureSession:
    return CaptureSession(
        app="test",
        source=Path("made up"),
        times=np.arange(len(T_zup)) / FPS,
        T_world_phone=np.linalg.inv(T_ZUP_ARKIT) @ T_zup,
    )


def test_a_take_reports_it_and_spreads_it_on_request(box):
    session = _session(_drifted(_round_trip(6), 6))
    take = to_object_motion(session, box, identity_mount())
    assert take.closure is not None
    assert take.closure.translation > 0.005
    assert take.notes == ()
    closed = to_object_motion(session, box, identity_mount(), Reading(closure=True))
    assert closed.closure == take.closure
    assert f"{100 * take.closure.translation:.1f} cm" in closed.notes[0]
    T = closed.motion.T_world_object
    assert np.linalg.norm(T[-15:, :3, 3].mean(axis=0) - T[:15, :3, 3].mean(axis=0)) < 5e-4


@pytest.mark.parametrize("code", ["closure-no-rests", "closure-elsewhere"])
def test_what_is_no_drift_is_refused(box, code: str):
    T = _round_trip(7)
    if code == "closure-no-rests":
        T = T[60:]
    else:
        T[-75:, 0, 3] += 0.8 * min_jerk(np.arange(75) / 40)
    session = _session(T)
    with pytest.raises(InputError) as caught:
        to_object_motion(session, box, identity_mount(), Reading(closure=True))
    assert caught.value.code == code
    assert to_object_motion(session, box, identity_mount()).segments
