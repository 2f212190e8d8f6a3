"""What is lifted, tipped or moved is held; what may rest is not said to be."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.contact.contact_config import SUPPORT
from omomo_core.contact.static_stability import must_be_held, overhang, touchable_range
from omomo_core.geometry.object_features import ObjectFeatures, object_features
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion

FRAMES = 90
T_ = np.arange(FRAMES) / FPS


def box(*size: float, fine: int = 0) -> ObjectMesh:
    solid = trimesh.creation.box(size)
    for _ in range(fine):
        solid = solid.subdivide()
    return ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")


def chair() -> ObjectMesh:
    """Seat, back and four legs; z up, floor at 0."""
    parts = [trimesh.creation.box((0.42, 0.42, 0.04)), trimesh.creation.box((0.42, 0.04, 0.5))]
    parts[0].apply_translation([0, 0, 0.44])
    parts[1].apply_translation([0, 0.19, 0.7])
    for x in (-0.19, 0.19):
        for y in (-0.19, 0.19):
            leg = trimesh.creation.box((0.04, 0.04, 0.42))
            leg.apply_translation([x, y, 0.21])
            parts.append(leg)
    solid = trimesh.util.concatenate(parts)
    return ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "chair")


def held(
    mesh: ObjectMesh, place: np.ndarray, turn: Rotation | None = None, *, grounded: bool = False
) -> np.ndarray:
    """must_be_held along positions (frames, 3); grounded: lowered until it touches the floor."""
    T = np.tile(np.eye(4), (len(place), 1, 1))
    if turn is not None:
        T[:, :3, :3] = turn.as_matrix()
    T[:, :3, 3] = place
    if grounded:
        T[:, 2, 3] -= object_features(ObjectMotion(mesh, T, np.ones(len(T), bool))).lowest
    return must_be_held(object_features(ObjectMotion(mesh, T, np.ones(len(T), bool))))


def at(x: np.ndarray | float, y: np.ndarray | float, z: np.ndarray | float) -> np.ndarray:
    return np.stack(np.broadcast_arrays(x + 0 * T_, y + 0 * T_, z + 0 * T_), axis=1)


def test_what_stands_still_on_the_floor_or_a_table_may_rest():
    for height in (0.2, 0.2 + 0.74):
        assert not held(box(0.4, 0.4, 0.4), at(0, 0, height)).any()


def test_what_trembles_in_the_air_is_held():
    sway = 0.006 * np.sin(2 * np.pi * 1.2 * T_)
    assert held(box(0.4, 0.4, 0.4), at(sway, 0, 1.1)).all()


def test_a_slow_lift_is_held_from_the_first_centimetres():
    height = np.interp(T_, [0.5, 2.5], [0.0, 0.14])
    is_held = held(box(0.4, 0.4, 0.4), at(0, 0, 0.2 + height))
    assert is_held[(height > 0.032) & (T_ < 2.4)].all()
    assert not is_held[T_ < 0.5].any()


def test_what_is_pushed_over_the_floor_is_held():
    x = np.interp(T_, [0.5, 2.5], [0.0, 0.8])
    is_held = held(box(0.4, 0.4, 0.4), at(x, 0, 0.2))
    assert is_held[(T_ > 0.6) & (T_ < 2.4)].all()
    assert not is_held[T_ < 0.4].any()


@pytest.mark.parametrize("mesh", [box(0.4, 0.4, 0.4), box(0.4, 0.4, 0.4, fine=4), chair()])
def test_what_is_tipped_is_held_even_when_still(mesh: ObjectMesh):
    for degrees, is_held in ((0, False), (3, False), (10, True), (20, True)):
        turn = Rotation.from_rotvec([np.radians(degrees), 0.0, 0.0])
        found = held(mesh, at(0, 0, 0), Rotation.concatenate([turn] * FRAMES), grounded=True)
        assert (found == is_held).all(), degrees


def test_round_things_lie_and_poles_do_not_stand_askew():
    lying = Rotation.from_rotvec([np.pi / 2, 0.0, 0.0])
    askew = Rotation.from_rotvec([np.radians(25), 0.0, 0.0])
    solid = trimesh.creation.cylinder(0.02, 1.4, sections=24)
    pole = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "pole")
    ball = trimesh.creation.icosphere(3, 0.12)
    for mesh, turn, is_held in (
        (ObjectMesh(np.array(ball.vertices), np.array(ball.faces), "ball"), askew, False),
        (pole, lying, False),
        (pole, askew, True),
    ):
        turns = Rotation.concatenate([turn] * FRAMES)
        assert (held(mesh, at(0, 0, 0), turns, grounded=True) == is_held).all()


def test_a_spike_of_the_tracker_holds_nothing():
    x = 0 * T_
    x[40] = 0.05
    assert not held(box(0.4, 0.4, 0.4), at(x, 0, 0.2)).any()


@given(seed=st.integers(0, 10_000), cut=st.integers(30, 60))
@settings(max_examples=30)
def test_a_frame_is_judged_by_the_twenty_around_it(seed: int, cut: int):
    rng = np.random.default_rng(seed)
    knots = np.array([0, 0, 0.2]) + rng.random((10, 3)) * [0.1, 0.1, 0.1]
    path = np.stack([np.interp(T_, np.linspace(0, 3, 10), k) for k in knots.T], axis=1)
    mesh = box(0.4, 0.4, 0.4)
    whole = held(mesh, path)
    np.testing.assert_array_equal(held(mesh, path[:cut])[:-20], whole[: cut - 20])
    np.testing.assert_array_equal(held(mesh, path[cut:])[20:], whole[cut + 20 :])


def touch(
    x: np.ndarray | float, height: np.ndarray | float = 0.2, turn: Rotation | None = None
) -> tuple[int, int]:
    """`touched` of a box at such places along x."""
    path = at(x, 0, height)
    T = np.tile(np.eye(4), (len(path), 1, 1))
    T[:, :3, 3] = path
    if turn is not None:
        T[:, :3, :3] = turn.as_matrix()
    take = object_features(ObjectMotion(box(0.4, 0.4, 0.4), T, np.ones(len(T), bool)))
    return touchable_range(take, must_be_held(take))


@pytest.mark.parametrize("speed", [0.04, 0.5])
def test_what_slides_flat_is_touched_shortly_before_and_what_is_lifted_gripped_earlier(
    speed: float,
):
    moves = np.interp(np.arange(FRAMES), [35, 53], [0.0, 0.6 * speed])
    turns = Rotation.from_euler("z", 6 * moves[:, None])
    for first, stop in (touch(moves), touch(0.0, turn=turns)):
        assert abs(first - (35 - SUPPORT.touching)) <= 3
        assert abs(stop - (53 + SUPPORT.touching)) <= 3
    rises = np.interp(np.arange(FRAMES), [35, 44, 53], [0.2, 0.4, 0.2])
    first, stop = touch(0.0, rises)
    assert abs(first - (35 - SUPPORT.gripping)) <= 3
    assert abs(stop - (53 + SUPPORT.gripping)) <= 3


def test_what_moves_at_the_ends_is_touched_there_and_what_rests_throughout_is_not():
    assert touch(0.3 * T_) == (0, FRAMES)
    assert touch(0.0) == (FRAMES, 0)
    noise = np.where(np.arange(FRAMES) == 40, 0.01, 0.0)
    assert touch(noise) == (FRAMES, 0)


@pytest.mark.parametrize(("speed", "is_held"), [(0.095, False), (0.105, True)])
def test_ten_centimetres_a_second_are_not_made_alone(speed: float, is_held: bool):
    assert (held(box(0.4, 0.4, 0.4), at(speed * T_, 0, 0.2)) == is_held).all()


@pytest.mark.parametrize(("spin", "is_held"), [(0.48, False), (0.52, True)])
def test_half_a_radian_a_second_is_not_turned_alone(spin: float, is_held: bool):
    turns = Rotation.from_euler("z", spin * T_[:, None])
    assert (held(box(0.4, 0.4, 0.4), at(0, 0, 0.2), turns) == is_held).all()


@pytest.mark.parametrize(
    ("speed", "spin", "is_held"),
    [(0.018, 0.0, False), (0.022, 0.0, True), (0.0, 0.09, False), (0.0, 0.11, True)],
)
def test_what_moves_or_turns_a_little_in_the_air_rests_on_nothing(
    speed: float, spin: float, is_held: bool
):
    turns = Rotation.from_euler("z", spin * T_[:, None])
    assert (held(box(0.4, 0.4, 0.4), at(speed * T_, 0, 0.9), turns) == is_held).all()
    assert not held(box(0.4, 0.4, 0.4), at(speed * T_, 0, 0.2), turns).any()


@pytest.mark.parametrize(("height", "is_held"), [(0.028, False), (0.032, True)])
def test_the_floor_carries_what_is_within_three_centimetres_of_it(height: float, is_held: bool):
    assert (held(box(0.4, 0.4, 0.4), at(0.05 * T_, 0, 0.2 + height)) == is_held).all()


@pytest.mark.parametrize(("frames", "rests"), [(15, 0), (16, 15)])
def test_what_pauses_in_the_air_rests_if_it_is_still_for_half_a_second(frames: int, rests: int):
    steps = np.concatenate([np.ones(39), np.zeros(frames), np.ones(39)]) * 0.05 / FPS
    x = np.concatenate([[0.0], np.cumsum(steps)])
    T = np.tile(np.eye(4), (len(x), 1, 1))
    T[:, 0, 3], T[:, 2, 3] = x, 1.1
    take = object_features(ObjectMotion(box(0.4, 0.4, 0.4), T, np.ones(len(x), bool)))
    assert (~must_be_held(take)).sum() == rests


_SLID = (40 - SUPPORT.touching, 46 + SUPPORT.touching)


@pytest.mark.parametrize(("steps", "frames", "hands"), [(4, 0, (FRAMES, 0)), (5, 6, _SLID)])
def test_what_slides_for_six_frames_is_held_and_touched_as_long(
    steps: int, frames: int, hands: tuple[int, int]
):
    x = np.interp(np.arange(FRAMES), [40, 40 + steps], [0.0, 0.5 * steps / FPS])
    assert held(box(0.4, 0.4, 0.4), at(x, 0, 0.2)).sum() == frames
    assert touch(x) == hands


@pytest.mark.parametrize(("frames", "is_moved"), [(11, False), (12, True)])
def test_what_creeps_for_half_a_second_is_moved(frames: int, is_moved: bool):
    """Its speed is a mean over five frames, and so is seen for three more."""
    x = np.interp(np.arange(FRAMES), [40, 40 + frames], [0.0, 0.08 * frames / FPS])
    assert (touch(x) != (FRAMES, 0)) == is_moved


@pytest.mark.parametrize(("beside", "is_held"), [(0.028, False), (0.032, True)])
def test_what_leans_is_held_once_its_centre_is_three_centimetres_beside_its_edge(
    beside: float, is_held: bool
):
    tall = box(0.1, 0.1, 1.0)

    def leaning(radians: float) -> ObjectFeatures:
        T = np.tile(np.eye(4), (FRAMES, 1, 1))
        T[:, :3, :3] = Rotation.from_rotvec([radians, 0.0, 0.0]).as_matrix()
        T[:, 2, 3] = -(tall.vertices @ T[0, 2, :3]).min()
        return object_features(ObjectMotion(tall, T, np.ones(FRAMES, bool)))

    tilts = np.linspace(0.1, 0.4, 301)
    far = [overhang(leaning(tilt), np.arange(1)).metres[0] for tilt in tilts]
    tilt = float(np.interp(beside, far, tilts))
    assert (must_be_held(leaning(tilt)) == is_held).all()


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("noise", [0.0, 0.0005, 0.0012, 0.0016])
def test_noise_of_the_tracker_is_no_touch(noise: float, seed: int):
    """A box that rests, is pushed for two seconds and rests again: nobody touches it before or after."""
    rng = np.random.default_rng(seed)
    T = np.tile(np.eye(4), (240, 1, 1))
    T[:, 0, 3] = np.interp(np.arange(240), [90, 150], [0.0, 1.0])
    T[:, 2, 3] = 0.15
    T[:, :3, 3] += rng.normal(scale=max(noise, 1e-9), size=(240, 3))
    turn = rng.normal(scale=max(2 * noise, 1e-9), size=(240, 3))
    T[:, :3, :3] = Rotation.from_rotvec(turn).as_matrix()
    take = object_features(ObjectMotion(box(0.3, 0.4, 0.3), T, np.ones(240, bool)))
    first, stop = touchable_range(take, must_be_held(take))
    assert 75 < first <= 91
    assert 149 <= stop < 165
