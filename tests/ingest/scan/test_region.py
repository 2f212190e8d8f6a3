"""Where the object is: told from cameras and sparse points alone."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ingest.scan.region import GivenBox, aim_at, find_aim, find_region
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest.scan.orbiting import box_points, floor_points, registered, ring, wall_points

LOW, HIGH = np.array([-0.25, -0.15, 0.0]), np.array([0.25, 0.15, 0.4])


def _room(*things, seed=0):
    rng = np.random.default_rng(seed)
    parts = [box_points(rng, *thing) for thing in things]
    return np.concatenate([floor_points(rng), wall_points(rng), *parts])


def _severities(region):
    return {note.name: note.severity for note in region.notes}


def test_cameras_in_an_orbit_look_at_its_middle_though_a_few_look_elsewhere():
    poses = ring([0.1, 0.2, 0.4])
    poses[:4, :3, :3] = poses[10:14, :3, :3]
    aim = find_aim(registered(poses, np.empty((0, 3))).views)
    assert np.allclose(aim.point, [0.1, 0.2, 0.4], atol=0.02)
    assert aim.distance == pytest.approx(1.4, abs=0.02)


def test_the_region_is_around_the_object_and_nothing_else():
    beside = (np.array([0.6, 0.3, 0.0]), np.array([0.9, 0.7, 0.9]))
    region = find_region(registered(ring([0, 0, 0.2]), _room((LOW, HIGH), beside)))
    low, high = region.low + region.T_world_floor[:3, 3], region.high + region.T_world_floor[:3, 3]
    assert (low[:2] < LOW[:2]).all()
    assert (high > HIGH).all()
    assert (low[:2] > LOW[:2] - 0.1).all()
    assert (high < HIGH + 0.1).all()
    assert region.low[2] == 0.0
    assert abs(region.T_world_floor[2, 3]) < 0.002
    assert _severities(region) == {"floor": "ok", "region": "ok"}


def test_a_lamp_is_one_though_its_pole_has_no_detail():
    foot = (np.array([-0.15, -0.15, 0.0]), np.array([0.15, 0.15, 0.03]))
    shade = (np.array([-0.15, -0.15, 1.1]), np.array([0.15, 0.15, 1.35]))
    region = find_region(registered(ring([0, 0, 0.7], distance=2.0), _room(foot, shade)))
    assert 1.35 < region.high[2] < 1.55


def test_a_pole_without_corners_is_followed_where_depth_maps_show_it():
    head = (np.array([-0.2, -0.06, 0.0]), np.array([0.2, 0.06, 0.04]))
    found = registered(ring([0, 0, 0.6], distance=2.0), _room(head))
    height = np.arange(0.05, 1.3, 0.02)
    pole = np.column_stack([0.1 * height, 0 * height, height])
    # Depth maps show the floor too, and the walls, as rough as they are.
    rng = np.random.default_rng(1)
    floor = np.add(floor_points(rng), [0.0, 0.0, 0.03])
    region = find_region(found, None, np.concatenate([pole, floor, wall_points(rng)]))
    assert 1.28 < region.high[2] < 1.45
    assert (np.abs(np.stack([region.low, region.high])[:, :2]) < 0.35).all()
    assert find_region(found).high[2] < 0.2


def test_the_aim_of_a_box_stands_in_for_cameras_that_look_elsewhere():
    outwards = ring([0, 0, 0.4])
    outwards[:, :3, :3] = outwards[:, :3, :3] @ np.diag([-1.0, 1.0, -1.0])
    views = registered(outwards, np.empty((0, 3))).views
    box = GivenBox(LOW, HIGH)
    assert np.allclose(aim_at(views, box).point, (LOW + HIGH) / 2)
    with pytest.raises(InputError):
        aim_at(views, None)


def test_two_things_under_the_same_gaze_are_a_warning():
    left = (np.array([-0.45, -0.1, 0.0]), np.array([-0.15, 0.1, 0.3]))
    right = (np.array([0.15, -0.1, 0.0]), np.array([0.45, 0.1, 0.3]))
    region = find_region(registered(ring([0, 0, 0.15]), _room(left, right)))
    assert _severities(region)["region"] == "warn"


def test_the_floor_is_upright_though_up_was_only_a_guess():
    lean = Rotation.from_euler("xy", [12, -9], degrees=True).as_matrix()
    T = np.eye(4)
    T[:3, :3] = lean
    world = registered(T @ ring([0, 0, 0.2]), _room((LOW, HIGH)) @ lean.T, up="cameras")
    region = find_region(world)
    normal = lean.T @ region.T_world_floor[:3, 2]
    assert np.degrees(np.arccos(normal[2])) < 0.2
    assert np.allclose(region.high - region.low, [0.6, 0.4, 0.45], atol=0.1)


def test_the_floor_wins_over_the_seat_of_a_chair():
    seat = (np.array([-0.3, -0.3, 0.45]), np.array([0.3, 0.3, 0.46]))
    region = find_region(registered(ring([0, 0, 0.5]), _room(seat)))
    assert abs(region.T_world_floor[2, 3]) < 0.005


def test_a_plain_floor_is_a_warning():
    rng = np.random.default_rng(0)
    points = box_points(rng, LOW, HIGH, 1500)
    region = find_region(registered(ring([0, 0, 0.2]), points[points[:, 2] < 0.38]))
    assert _severities(region)["floor"] == "warn"
    assert abs(region.T_world_floor[2, 3]) < 0.03


def test_a_given_box_is_taken_and_stands_on_the_floor():
    points = _room((LOW, HIGH))
    box = GivenBox(np.array([0.3, 0.25, 0.05]), np.array([0.7, 0.55, 0.65]))
    region = find_region(registered(ring([0, 0, 0.2]), points), box)
    T = inverse(region.T_world_floor)
    assert region.low[2] == 0.0
    assert np.allclose(T[:3, :3] @ box.high + T[:3, 3], region.high, atol=0.01)
    assert np.allclose((T[:3, :3] @ box.low + T[:3, 3])[:2], region.low[:2], atol=0.01)


@pytest.mark.parametrize(
    ("low", "high"),
    [([0, 0, 0], [0.5, 0.5, -0.1]), ([0, 0, 0], [50, 50, 50]), ([0, 0, np.nan], [1, 1, 1])],
)
def test_a_box_that_is_none_is_refused(low, high):
    box = GivenBox(np.array(low, float), np.array(high, float))
    with pytest.raises(InputError) as refused:
        find_region(registered(ring([0, 0, 0.2]), _room((LOW, HIGH))), box)
    assert refused.value.code == "scan-box"


def test_cameras_that_look_at_no_one_place_are_refused():
    outwards = ring([0, 0, 0.4])
    outwards[:, :3, :3] = outwards[:, :3, :3] @ np.diag([-1.0, 1.0, -1.0])
    with pytest.raises(InputError) as refused:
        find_region(registered(outwards, _room((LOW, HIGH))))
    assert refused.value.code == "scan-no-aim"


def test_pictures_from_one_direction_are_refused():
    with pytest.raises(InputError) as refused:
        find_region(registered(ring([0, 0, 0.3], turn=0.1, elevations=(0.3,)), _room((LOW, HIGH))))
    assert refused.value.code == "scan-no-orbit"


def test_nothing_on_the_floor_is_refused():
    with pytest.raises(InputError) as refused:
        find_region(registered(ring([0, 0, 0.2]), _room()))
    assert refused.value.code == "scan-no-object"
