"""The floor is under the object where it rests."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.trajectory.floor import find_floor
from ingest.trajectory.plane import fit_plane
from ingest.trajectory.rests import find_rests, is_steady
from omomo_core.motion import ObjectMesh


def _path(*stops: tuple[float, float], jitter: float = 4e-4) -> np.ndarray:
    """Poses at 30 fps through (seconds, height): equal neighbours are rests."""
    seconds, heights = np.array(stops).T
    clock = np.arange(int(seconds[-1] * 30)) / 30
    T = np.tile(np.eye(4), (len(clock), 1, 1))
    rng = np.random.default_rng(0)
    T[:, 2, 3] = np.interp(clock, seconds, heights)
    moving = np.gradient(T[:, 2, 3]) != 0
    T[:, 0, 3] = np.cumsum(np.where(moving, 0.5 / 30, 0))
    T[:, :3, 3] += rng.normal(scale=jitter, size=(len(T), 3))
    T[:, :3, :3] = Rotation.from_rotvec(rng.normal(scale=8e-4, size=(len(T), 3))).as_matrix()
    return T


def _valid(T: np.ndarray) -> np.ndarray:
    return np.ones(len(T), bool)


def test_rests_are_found_where_they_are():
    T = _path((0, 0), (1, 0), (2, 0.8), (3, 0.8), (4, 0))
    found = find_rests(T, _valid(T))
    assert len(found) == 2
    np.testing.assert_allclose(found, [(0, 30), (60, 90)], atol=2)


def test_turning_in_place_is_no_rest():
    T = np.tile(np.eye(4), (60, 1, 1))
    T[:, :3, :3] = Rotation.from_euler("z", np.arange(60)[:, None], degrees=True).as_matrix()
    assert find_rests(T, _valid(T)) == []


def test_the_lowest_rest_wins(box):
    T = _path((0, -1.3), (1, -1.3), (2, -0.6), (3, -0.6), (4, -1.31), (5, -1.31))
    floor = find_floor(T, _valid(T), box)
    assert floor.source == "rest"
    assert floor.certain
    assert floor.height == pytest.approx(-1.305, abs=0.004)


def test_the_lowest_vertex_counts_not_the_origin(box):
    T = _path((0, -1.0), (1.5, -1.0), (2, 0), (3, 0.2))
    T[:, :3, :3] = Rotation.from_euler("x", 90, degrees=True).as_matrix()
    floor = find_floor(T, _valid(T), box)
    assert floor.height == pytest.approx(-1.15, abs=0.003)


def test_lost_frames_are_no_rest(box):
    T = _path((0, -1.3), (1, -1.3), (2, -0.6), (3.5, -0.6))
    valid = _valid(T)
    valid[:60] = False
    assert find_floor(T, valid, box).height == pytest.approx(-0.6, abs=0.003)


def test_never_at_rest_is_said_and_assumed(box):
    T = _path((0, 0), (1, 0.1), (2, 0.0), (3, 0.1))
    floor = find_floor(T, _valid(T), box)
    assert floor.source == "assumed"
    assert not floor.certain
    assert "guess" in floor.message
    centre = np.median(T[:, 2, 3]) + 0.25
    assert centre - floor.height == pytest.approx(1.0, abs=0.01)


def test_an_assumed_floor_is_never_above_the_object(box):
    T = _path((0, 0), (1, -1.5), (1.2, 0), (4, 0.2))
    floor = find_floor(T, _valid(T), box)
    assert floor.height <= T[:, 2, 3].min() + 0.01


def test_held_still_in_the_air_then_set_lower(box):
    T = _path((0, 0), (1, 0), (2, -0.9), (2.1, -0.91), (3, 0.1))
    floor = find_floor(T, _valid(T), box)
    assert floor.source == "lowest"
    assert floor.height == pytest.approx(-0.9, abs=0.05)
    assert "0.9" in floor.message


def test_a_given_height_wins(box):
    T = _path((0, 0), (2, 0))
    assert find_floor(T, _valid(T), box, -0.77).height == -0.77


def test_a_flat_object_has_a_floor_too():
    square = np.array([[0, 0, 0.0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    flat = ObjectMesh(square, np.array([[0, 1, 2], [0, 2, 3]]), "tray")
    T = _path((0, 0.4), (2, 0.4))
    assert find_floor(T, _valid(T), flat).height == pytest.approx(0.4, abs=0.005)


def _room(floor: float, table: float | None = None, seed: int = 0) -> np.ndarray:
    """Points that a phone sees, z up: the floor, a wall, clutter, perhaps a table on it."""
    rng = np.random.default_rng(seed)
    ground = rng.uniform([-2, -2, floor], [2, 2, floor], (2000, 3))
    wall = rng.uniform([2, -2, floor], [2, 2, floor + 2.5], (2500, 3))
    clutter = rng.uniform([-2, -2, floor], [2, 2, floor + 1], (800, 3))
    parts = [ground, wall, clutter]
    if table is not None:
        parts.append(rng.uniform([-0.8, -0.6, table], [0.8, 0.6, table], (3000, 3)))
    return np.concatenate(parts) + rng.normal(scale=0.006, size=(sum(map(len, parts)), 3))


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6), tilt=st.floats(0, 0.6))
def test_a_plane_is_found_amid_a_room(seed: int, tilt: float):
    R = Rotation.from_rotvec([tilt, 0, 0]) * Rotation.from_euler("z", seed % 7)
    points = R.apply(_room(-1.2, seed=seed))
    plane = fit_plane(points, np.array([0.0, 0.0, 1.0]), 0.8)
    assert plane is not None
    np.testing.assert_allclose(plane.normal, R.apply([0, 0, 1]), atol=0.004)
    assert plane.offset == pytest.approx(-1.2, abs=0.006)


def test_a_cloud_has_no_plane():
    points = np.random.default_rng(0).normal(size=(3000, 3))
    assert fit_plane(points, np.array([0.0, 0.0, 1.0]), 0.8) is None
    assert fit_plane(points[:5], np.array([0.0, 0.0, 1.0]), 0.8) is None


def test_depth_shows_the_floor_when_nothing_rests(box):
    T = _path((0, 0), (1, 0.1), (2, 0.0), (3, 0.1))
    floor = find_floor(T, _valid(T), box, None, _room(-0.9))
    assert floor.source == "depth"
    assert floor.certain
    assert floor.height == pytest.approx(-0.9, abs=0.006)
    assert "depth maps" in floor.message


def test_an_object_that_only_rests_on_a_table_is_not_on_the_floor(box):
    T = _path((0, -0.2), (1, -0.2), (2, 0.3), (3, -0.2), (4, -0.2))
    floor = find_floor(T, _valid(T), box, None, _room(-0.95))
    assert floor.source == "depth"
    assert floor.height == pytest.approx(-0.95, abs=0.006)
    assert "0.75 m below" in floor.message


def test_where_it_rests_on_the_floor_the_object_is_more_exact_than_depth(box):
    T = _path((0, -0.9), (1, -0.9), (2, 0.3), (3, -0.9), (4, -0.9))
    floor = find_floor(T, _valid(T), box, None, _room(-0.93, table=-0.2))
    assert floor.source == "rest"
    assert floor.height == pytest.approx(-0.9, abs=0.003)


def test_a_plane_above_the_object_is_no_floor(box):
    T = _path((0, -0.9), (1, -0.9), (2, -0.5), (3.5, -0.5))
    floor = find_floor(T, _valid(T), box, None, _room(0.0))
    assert floor.source == "rest"
    assert floor.height == pytest.approx(-0.9, abs=0.003)


def test_a_given_height_wins_over_depth(box):
    T = _path((0, 0), (2, 0))
    assert find_floor(T, _valid(T), box, -0.77, _room(-1.2)).height == -0.77


def test_a_long_rest_counts_more_than_a_short_one(box):
    """Both are on the same floor; tracking drifted by 2 cm between them."""
    T = _path((0, -1.30), (1, -1.30), (2, -0.6), (3, -1.28), (7, -1.28), jitter=1e-5)
    floor = find_floor(T, _valid(T), box)
    assert floor.source == "rest"
    assert floor.height == pytest.approx((1 * -1.30 + 4 * -1.28) / 5, abs=0.0008)


def test_of_rests_far_apart_in_height_the_lowest_alone_counts(box):
    T = _path((0, -1.30), (1, -1.30), (2, -0.6), (3, -1.26), (7, -1.26), jitter=1e-5)
    assert find_floor(T, _valid(T), box).height == pytest.approx(-1.30, abs=0.001)


def test_where_the_room_lies_does_not_matter(box):
    T = _path((0, -0.2), (1, -0.2), (2, 0.3), (3, -0.2), (4, -0.2))
    here = find_floor(T, _valid(T), box, None, _room(-0.95))
    away = np.array([7.0, 9.0, 0.0])
    T[:, :3, 3] += away
    there = find_floor(T, _valid(T), box, None, _room(-0.95) + away)
    assert there.source == "depth"
    assert there.height == pytest.approx(here.height, abs=0.003)


@pytest.mark.parametrize(("metres", "degrees"), [(0.0012, 0.0), (0.0, 0.3)])
def test_what_trembles_more_than_a_thing_on_the_floor_is_held(metres: float, degrees: float):
    """Unless the log itself is as noisy."""
    rng = np.random.default_rng(0)
    T = np.tile(np.eye(4), (90, 1, 1))
    assert is_steady(T)
    T[:, :3, 3] += rng.normal(scale=metres, size=(90, 3))
    turns = rng.normal(scale=np.radians(degrees), size=(90, 3))
    T[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    assert not is_steady(T)
    assert is_steady(T, (metres, np.radians(degrees)))
    assert not is_steady(T, (metres / 3, np.radians(degrees) / 3))
