"""Pinhole cameras and the camera that follows."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from render.cameras import FollowStyle, follow, follow_azimuth, look_at, orbit, pinhole

W, H = 960, 540
place = st.tuples(*[st.floats(-5, 5)] * 3).map(np.array)


@given(eye=place, target=place)
@example(eye=np.array([1e-6, 0.0, 2.0]), target=np.array([0.0, 0.0, 0.0]))
@example(eye=np.array([0.0, 0.0, -2.0]), target=np.array([0.0, 1e-6, 0.0]))
def test_look_at_puts_the_target_in_the_middle_and_stays_level(
    eye: np.ndarray, target: np.ndarray
) -> None:
    distance = np.linalg.norm(target - eye)
    if distance < 0.01:
        return
    T = look_at(eye, target)
    assert np.allclose(T[:3, :3].T @ T[:3, :3], np.eye(3), atol=1e-9)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    assert T[2, 0] == pytest.approx(0.0, abs=1e-9)  # the right axis lies level
    assert T[2, 1] > -1e-9  # and up is up
    u, v, depth = pinhole(T, 0.6, W, H).project(target)
    assert (u, v) == pytest.approx(((W - 1) / 2, (H - 1) / 2), abs=1e-3)
    assert depth == pytest.approx(distance)


def test_field_of_view_spans_the_height() -> None:
    camera = pinhole(np.eye(4), 0.8, W, H)
    _, v, _ = camera.project(np.array([0.0, np.tan(0.4), -1.0]))
    assert v == pytest.approx(-0.5)  # the upper edge of the first row


def test_orbit_stands_where_it_says() -> None:
    T = orbit(np.array([1.0, 2.0, 0.5]), 3.0, np.pi / 2, 0.0)
    assert np.allclose(T[:3, 3], [1.0, 5.0, 0.5])
    assert np.allclose(orbit(np.zeros(3), 2.0, 0.7, np.pi / 2)[:3, 3], [0, 0, 2.0])


def stroll(frames: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A person who walks, turns about sharply, and carries something in front of them."""
    rng = np.random.default_rng(seed)
    turns = np.zeros(frames)
    turns[rng.integers(0, frames, 4)] = rng.uniform(-2.5, 2.5, 4)
    heading = rng.uniform(-3, 3) + np.cumsum(turns)
    facing = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    person = np.cumsum(facing * 0.04, axis=0)
    held = person + 0.5 * facing
    base = np.concatenate([person, np.zeros((frames, 1))], axis=1)
    around = rng.uniform([-0.4, -0.4, 0.0], [0.4, 0.4, 1.8], (20, 3))
    carried = np.concatenate([held, np.full((frames, 1), 1.1)], axis=1)
    return np.concatenate([base[:, None] + around, carried[:, None]], 1), person, facing, held


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("frames", [1, 7, 400])
def test_following_keeps_everything_in_the_picture(frames: int, seed: int) -> None:
    subject, person, facing, held = stroll(frames, seed)
    cameras = follow(subject, person, facing, held, W, H)
    assert len(cameras) == frames
    for camera, points in zip(cameras, subject, strict=True):
        u, v, depth = camera.project(points).T
        assert depth.min() > 0.5
        assert u.min() > 0.05 * W
        assert u.max() < 0.95 * W
        assert v.min() > 0.05 * H
        assert v.max() < 0.95 * H


@pytest.mark.parametrize("seed", range(4))
def test_following_never_jerks(seed: int) -> None:
    cameras = follow(*stroll(600, seed), W, H)
    forward = np.stack([c.T_world_camera[:3, 2] for c in cameras])
    eye = np.stack([c.T_world_camera[:3, 3] for c in cameras])
    turn = np.degrees(np.linalg.norm(np.diff(forward, axis=0), axis=1)) * 30
    assert turn.max() < 50.0  # degrees a second
    acceleration = np.linalg.norm(np.diff(eye, 2, axis=0), axis=1) * 900
    assert acceleration.max() < 8.0  # metres a second squared


@pytest.mark.parametrize("heading", [-2.0, 0.0, 1.3, 3.1])
def test_a_person_who_stands_is_seen_from_three_quarters(heading: float) -> None:
    facing = np.tile([np.cos(heading), np.sin(heading)], (90, 1))
    person = np.zeros((90, 2))
    azimuth = follow_azimuth(person, facing, person + 0.4 * facing)
    off = np.abs((azimuth - heading + np.pi) % (2 * np.pi) - np.pi)
    assert np.abs(off - FollowStyle().three_quarter).max() < 0.2


def test_an_object_at_the_side_is_seen_from_that_side() -> None:
    facing, person = np.tile([1.0, 0.0], (90, 1)), np.zeros((90, 2))
    left = follow_azimuth(person, facing, person + np.array([0.0, 0.6]))
    right = follow_azimuth(person, facing, person - np.array([0.0, 0.6]))
    assert np.sin(left).min() > 0.3
    assert np.sin(right).max() < -0.3
