"""Short limbs: footholds move as a whole, so feet stand still, legs reach the floor and arms the object."""

from dataclasses import replace

import numpy as np
import pytest

from capture_app.exports.footholds import (
    HIPS,
    LimbTargets,
    leg_length,
    limb_length,
    raised_shoulders,
    within_reach,
)
from omomo_core.body.body_config import LIMB
from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import runs

UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
FRAMES = 90
STANDS = (((0, 25), (35, 65), (75, FRAMES)), ((0, 10), (20, 45), (55, FRAMES)))


@pytest.fixture(scope="module")
def small(shipped: BodyModel) -> BodyModel:
    return replace(shipped, rest_joints=shipped.rest_joints * 0.6, vertices=shipped.vertices * 0.6)


def walking(body: BodyModel, ahead: float) -> tuple[np.ndarray, np.ndarray, LimbTargets]:
    """Hips, rotations and targets of a walk of 0.3 m/s; palms are to be that far ahead of the shoulders."""
    R = np.tile(UPRIGHT, (FRAMES, 22, 1, 1))
    along = np.arange(FRAMES)[:, None] * [0.0, -0.01, 0.0]
    bent = 0.08 * leg_length(body)
    root = along + np.array([0.0, 0.0, body.rest_joints[0, 1].item() - bent])
    joints = joints_of(body, root, R)
    stands, ankles = np.zeros((FRAMES, 2), bool), np.zeros((FRAMES, 2, 3))
    for side, spans in enumerate(STANDS):
        frames, places = [], []
        for start, stop in spans:
            stands[start:stop, side] = True
            frames += [start, stop - 1]
            places += 2 * [joints[(start + stop) // 2, HIPS[side], 1]]
        ankles[:, side] = joints[:, 7 + side]
        ankles[:, side, 1] = np.interp(np.arange(FRAMES), frames, places)
        ankles[:, side, 2] = joints[0, 7 + side, 2] + bent
    palms = joints[:, [16, 17]] + joints[:, 22:] - joints[:, 20:22] + [0.0, -ahead, 0.0]
    return root, R, LimbTargets(ankles, stands, palms, np.ones((FRAMES, 2)))


def stretch(
    body: BodyModel, root: np.ndarray, R: np.ndarray, targets: LimbTargets, ankles: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Shares of their lengths at which arms, and legs that stand, would reach their targets."""
    joints = joints_of(body, root, R)
    wrists = targets.palms - joints[:, 22:] + joints[:, 20:22]
    arms = np.linalg.norm(wrists - joints[:, [16, 17]], axis=-1) / limb_length(body, 16, 18, 20)
    legs = np.linalg.norm(joints[:, HIPS] - ankles, axis=-1) / leg_length(body)
    return arms, legs[targets.stands]


def test_what_is_within_reach_stays(small: BodyModel) -> None:
    root, R, targets = walking(small, ahead=0.2)
    moved, ankles = within_reach(small, root, R, targets, 30.0)
    np.testing.assert_array_equal(moved, root)
    np.testing.assert_array_equal(ankles, targets.ankles)


@pytest.mark.parametrize("fps", [30.0, 60.0])
def test_feet_go_along_with_hips_and_stand_still(small: BodyModel, fps: float) -> None:
    root, R, targets = walking(small, ahead=0.6)
    moved, ankles = within_reach(small, root, R, targets, fps)
    arms, legs = stretch(small, moved, R, targets, ankles)
    assert arms.max() < 1.01
    assert legs.max() < LIMB.stretch + 1e-6
    for side in range(2):
        for start, stop in runs(targets.stands[:, side]):
            assert np.ptp(ankles[start:stop, side], axis=0).max() < 1e-9
    np.testing.assert_array_equal(ankles[..., 2], targets.ankles[..., 2])
    assert (ankles - targets.ankles)[..., 1].max() < -0.1


def test_feet_stay_on_the_floor_where_arms_cannot_reach(small: BodyModel) -> None:
    root, R, targets = walking(small, ahead=0.2)
    high = replace(targets, palms=targets.palms + np.array([0.0, 0.0, 1.0]))
    moved, ankles = within_reach(small, root, R, high, 30.0)
    arms, legs = stretch(small, moved, R, high, ankles)
    assert arms.min() > 1.2
    assert legs.max() < LIMB.stretch + 1e-6


def test_hips_do_not_sink_into_the_feet(small: BodyModel) -> None:
    root, R, targets = walking(small, ahead=0.2)
    low = replace(targets, palms=targets.palms * [1.0, 1.0, 0.0])
    moved, ankles = within_reach(small, root, R, low, 30.0)
    height = joints_of(small, moved, R)[:, HIPS, 2] - ankles[..., 2]
    assert height.min() > 0.15 * leg_length(small)


def test_shoulders_turn_as_far_as_arms_are_too_short(small: BodyModel) -> None:
    root, R, targets = walking(small, ahead=0.315)
    before, _ = stretch(small, root, R, targets, targets.ankles)
    turned = raised_shoulders(small, root, R, targets)
    after, _ = stretch(small, root, turned, targets, targets.ankles)
    assert before.min() > 1.02
    np.testing.assert_allclose(after, LIMB.stretch, atol=1e-6)
    near = walking(small, ahead=0.2)
    np.testing.assert_array_equal(raised_shoulders(small, *near), near[1])
