"""Steps that replace gliding: their pace, how long and how high a foot is in the air, where it lands."""

from itertools import pairwise

import numpy as np
import pytest

from omomo_core.generation.solving.foot_plan import add_steps
from omomo_core.generation.solving.solving_config import STEPS
from omomo_core.geometry.runs import runs
from omomo_core.motion import FPS

NONE = np.zeros((0, 2), bool)
WIDE = np.array([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]])


def gliding(pace: float, frames: int = 301, rest: int = 0) -> np.ndarray:
    """Two ankles side by side that glide along y, after a rest and before another; (frames, 2, 3)."""
    way = np.concatenate([np.zeros(rest), np.arange(frames), np.full(rest, frames - 1.0)])
    ankles = np.tile(WIDE, (len(way), 1, 1))
    ankles[..., 1] = (pace / FPS * way)[:, None]
    return ankles


def stepping(ankles: np.ndarray, stood: np.ndarray = NONE) -> tuple[np.ndarray, np.ndarray]:
    return add_steps(ankles, np.zeros(ankles.shape[:2], bool), stood)


def swings(feet: np.ndarray, side: int) -> list[tuple[int, int]]:
    """When a foot goes, in steps from frame to frame."""
    return runs(np.linalg.norm(np.diff(feet[:, side], axis=0), axis=-1) > 1e-9)


@pytest.mark.parametrize(("pace", "each_second"), [(0.4, 1.55), (0.8, 1.75), (1.4, 2.05)])
def test_people_take_longer_and_quicker_steps_the_faster_they_walk(pace: float, each_second: float):
    feet, _ = stepping(gliding(pace))
    count = len(swings(feet, 0)) + len(swings(feet, 1))
    assert count == round(10 * each_second)


@pytest.mark.parametrize("pace", [0.4, 0.8, 1.4])
def test_a_foot_is_in_the_air_for_seven_tenths_of_a_step(pace: float):
    feet, standing = stepping(gliding(pace))
    found = sorted(swings(feet, 0) + swings(feet, 1))
    step = np.mean(np.diff([a for a, _ in found]))
    assert np.mean([b - a for a, b in found]) / step == pytest.approx(0.72, abs=0.02)
    # One foot stands while the other goes, and both stand between two steps.
    assert standing.any(axis=1).all()
    assert standing.all(axis=1).mean() == pytest.approx(1 - 0.72 + 1 / step, abs=0.02)
    for side in range(2):
        for a, b in swings(feet, side):
            assert not standing[a + 1 : b, side].any()
            assert standing[[a, b], side].all()


def test_a_long_step_rises_seven_centimetres_and_a_short_one_less():
    far, _ = stepping(gliding(1.4))
    middle = [feet for feet in swings(far, 0)][3]
    assert far[middle[0] : middle[1] + 1, 0, 2].max() == pytest.approx(0.07, abs=0.002)
    near, _ = stepping(gliding(0.7, 21))
    a, b = swings(near, 0)[0]
    length = np.linalg.norm(near[b, 0] - near[a, 0])
    assert 0.2 < length < 0.4
    assert near[a : b + 1, 0, 2].max() == pytest.approx(STEPS.lift * length / 0.4, abs=0.002)


def test_a_stance_lies_under_the_hips_in_its_middle():
    ankles = gliding(1.0)
    feet, _ = stepping(ankles)
    for side in range(2):
        going = swings(feet, side)
        for (_, down), (up, _) in list(pairwise(going))[1:-1]:
            middle = (down + up) / 2
            at = np.interp(middle, np.arange(len(ankles)), ankles[:, side, 1])
            # In the air for 0.72 of a step the foot stands for 1.28: its middle is nearly there.
            assert abs(feet[down, side, 1] - at) < 0.1
            assert np.ptp(feet[down : up + 1, side], axis=0).max() < 1e-9


def test_steps_begin_and_end_smoothly():
    feet, _ = stepping(gliding(1.0))
    a, b = swings(feet, 1)[4]
    way = feet[a : b + 1, 1, 1] - feet[a, 1, 1]
    share = np.arange(b - a + 1) / (b - a)
    np.testing.assert_allclose(way / way[-1], share**2 * (3 - 2 * share), atol=1e-9)


@pytest.mark.parametrize(("pace", "steps"), [(0.31, True), (0.29, False)])
def test_what_is_slower_than_a_foot_can_be_that_stands_is_left(pace: float, steps: bool):
    ankles = gliding(pace)
    feet, standing = add_steps(ankles, np.ones((len(ankles), 2), bool), NONE)
    assert (feet != ankles).any() == steps
    assert standing.all() != steps


@pytest.mark.parametrize(("frames", "steps"), [(8, False), (9, True)])
def test_a_glide_of_eight_frames_is_one(frames: int, steps: bool):
    """Speeds of the first and last frame are halved by the rest beside them, and still fast."""
    ankles = gliding(0.7, frames - 1, rest=20)
    feet, _ = stepping(ankles)
    assert (feet != ankles).any() == steps


def test_a_short_glide_is_two_steps():
    feet, _ = stepping(gliding(0.7, 16))
    assert [len(swings(feet, side)) for side in range(2)] == [1, 1]


@pytest.mark.parametrize(("pause", "one"), [(10, True), (11, False)])
def test_a_short_pause_does_not_end_a_walk(pause: int, one: bool):
    steps = np.concatenate([np.ones(60), np.zeros(pause), np.ones(60)]) / FPS
    ankles = np.tile(WIDE, (len(steps) + 1, 1, 1))
    ankles[1:, :, 1] = np.cumsum(steps)[:, None]
    _, standing = stepping(ankles)
    rest = slice(62, 59 + pause)
    assert standing[rest].any() == one


@pytest.mark.parametrize("landing", [30, 4])
def test_a_foot_in_the_air_after_a_walk_does_not_jump_to_where_the_sample_has_it(landing: int):
    """After the glide the right foot stands, and the left one goes on through the air, then lands."""
    walked, after = 45, 60
    frames = walked + after
    ankles = np.tile(WIDE, (frames, 1, 1))
    pace = np.zeros((frames, 2))
    pace[1:walked] = 1.2 / FPS
    pace[walked : walked + landing, 0] = 1.5 / FPS
    ankles[..., 1] = pace.cumsum(axis=0)
    down = np.ones((frames, 2), bool)
    feet, standing = add_steps(ankles, down, NONE)
    assert (feet[:walked] != ankles[:walked]).any()
    assert not standing[walked + 1 : walked + landing - 1, 0].any()
    speed = FPS * np.linalg.norm(np.diff(feet[:, 0], axis=0), axis=-1)
    assert speed[walked - 2 : walked + landing].max() < 4.5
    np.testing.assert_array_equal(feet[walked + landing + 1 :], ankles[walked + landing + 1 :])


@pytest.mark.parametrize(
    ("ahead", "stood", "first"),
    [
        (0.1, (True, True), 1),
        (-0.1, (True, True), 0),
        (0.1, (False, True), 0),
        (-0.1, (True, False), 1),
    ],
)
def test_a_foot_in_the_air_goes_first_or_else_the_one_that_lags(
    ahead: float, stood: tuple[bool, bool], first: int
):
    ankles = gliding(0.8) + np.array([0.0, -30.0, 0.0])  # away from the origin
    ankles[:, 0, 1] += ahead
    feet, _ = stepping(ankles, np.array([stood]))
    begin = [swings(feet, side)[0][0] for side in range(2)]
    assert int(np.argmin(begin)) == first


def test_what_is_decided_stays():
    ankles = gliding(0.8)
    stood = np.tile([True, False], (40, 1))
    feet, standing = stepping(ankles, stood)
    np.testing.assert_array_equal(feet[:40], ankles[:40])
    np.testing.assert_array_equal(standing[:39], stood[:39])
    assert (feet[41:60] != ankles[41:60]).any()


def test_a_walk_whose_feet_take_turns_is_left():
    ankles = np.tile(WIDE, (120, 1, 1))
    going = (np.arange(120) // 15) % 2
    for side in range(2):
        ankles[:, side, 1] = np.cumsum((going == side) * 1.2 / FPS)
    feet, standing = add_steps(ankles, np.ones((120, 2), bool), NONE)
    np.testing.assert_array_equal(feet, ankles)
    assert standing[5:10, 1].all()
    assert not standing[5:10, 0].any()


def test_a_glide_too_short_for_steps_is_left_as_it_is():
    """Two steps in a third of a second over 1.4 m each would be leaps."""
    ankles = gliding(4.2, 11, rest=20)
    feet, standing = stepping(ankles)
    assert (feet == ankles).all()
    assert not standing[22:28].any()
    slow, _ = stepping(gliding(1.2, 31, rest=20))
    assert (slow != gliding(1.2, 31, rest=20)).any()
