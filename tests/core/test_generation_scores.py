"""What each fault of a sample costs, and how it is measured."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.person import FingerFit, Person
from omomo_core.generation.selection.ranking import score
from omomo_core.motion import FPS, HumanMotion
from omomo_core.skeleton import joint

FRAMES = 40
TOES = (joint("left_foot"), joint("right_foot"))
FEET = (joint("left_ankle"), joint("right_ankle"), *TOES)
"""In the order of a motion's foot contacts."""


def person(**changes: np.ndarray) -> Person:
    """Somebody who stands still, holds nothing and is nowhere in the object."""
    joints = np.zeros((FRAMES, 24, 3))
    joints[..., 2] = 0.1 * np.arange(24)
    joints[:, FEET, 2] = 0.05
    parts = {
        "joints": joints,
        "hand_contact": np.zeros((FRAMES, 2)),
        "foot_contact": np.ones((FRAMES, 4)),
        "miss": np.zeros((FRAMES, 2)),
        "depth": np.zeros(FRAMES),
        **changes,
    }
    human = HumanMotion(
        root=parts["joints"][:, 0],
        rotations=np.tile(np.eye(3), (FRAMES, 22, 1, 1)),
        fingers=np.tile(np.eye(3), (FRAMES, 30, 1, 1)),
        joints=parts["joints"],
        hand_contact=parts["hand_contact"],
        foot_contact=parts["foot_contact"],
    )
    return Person(human, tuple[ContactSegment, ...](), parts["miss"], parts["depth"])


def judged(must_hold: np.ndarray | None = None, **changes: np.ndarray) -> dict[str, float]:
    return score(person(**changes), np.zeros(FRAMES, bool) if must_hold is None else must_hold)


def columns(*values: float) -> np.ndarray:
    return np.tile(values, (FRAMES, 1)).astype(float)


def test_who_stands_still_has_no_fault():
    assert set(judged().values()) == {0.0}


def test_hands_in_the_object_and_wrists_that_are_bent_too_far_count_where_they_hold():
    depth = columns(0.01, 0.3)
    fit = FingerFit(depth, np.zeros((FRAMES, 2)), np.zeros((FRAMES, 2), int))
    one_hand = replace(person(hand_contact=columns(1.0, 0.0)), finger_fit=fit)
    found = score(one_hand, np.zeros(FRAMES, bool))
    assert found["hands_inside_cm"] == pytest.approx(1.0)
    assert found["wrists_beyond"] == 0.0
    one_hand.human.rotations[:10, joint("left_wrist")] = Rotation.from_euler("y", 1.0).as_matrix()
    one_hand.human.rotations[:30, joint("right_wrist")] = Rotation.from_euler("y", 1.0).as_matrix()
    assert score(one_hand, np.zeros(FRAMES, bool))["wrists_beyond"] == pytest.approx(0.25)


def test_an_object_that_nobody_holds_costs_twenty_and_half_of_it_ten():
    must = np.arange(FRAMES) < 20
    assert judged(must)["total"] == pytest.approx(20.0)
    held = np.zeros((FRAMES, 2))
    held[10:20, 1] = 1.0
    held[30:, 0] = 1.0
    assert judged(must, hand_contact=held)["unheld"] == 0.5
    assert judged(must, hand_contact=held)["total"] == pytest.approx(10.0)
    # A hand counts from more than half a contact on.
    assert judged(must, hand_contact=0.5 * held)["unheld"] == 1.0
    assert judged(must, hand_contact=0.51 * held)["unheld"] == 0.5


def test_a_centimetre_that_a_holding_palm_misses_costs_one():
    one_hand, miss = columns(1.0, 0.0), columns(0.03, 0.5)
    assert judged(hand_contact=one_hand, miss=miss)["miss_cm"] == pytest.approx(3.0)
    assert judged(hand_contact=one_hand, miss=miss)["total"] == pytest.approx(3.0)
    assert judged(miss=miss)["total"] == 0.0


def test_five_centimetres_a_second_of_a_planted_foot_cost_one():
    sliding = person().human.joints
    sliding[:, FEET[0], 0] += 0.2 / FPS * np.arange(FRAMES)
    # One of four feet and toes goes at 20 cm/s.
    found = judged(joints=sliding)
    assert found["skate_cm_s"] == pytest.approx(5.0)
    assert found["total"] == pytest.approx(1.0)
    for foot in range(4):
        one = person().human.joints
        one[:, FEET[foot], 1] += 0.2 / FPS * np.arange(FRAMES)
        planted = np.eye(4)[foot].repeat(FRAMES).reshape(4, FRAMES).T
        assert judged(joints=one, foot_contact=planted)["skate_cm_s"] == pytest.approx(20.0)
    lifted = np.ones((FRAMES, 4))
    lifted[:, 0] = 0.5
    assert judged(joints=sliding, foot_contact=lifted)["total"] == pytest.approx(0.0, abs=1e-9)
    assert judged(joints=sliding, foot_contact=1 - lifted)["total"] == pytest.approx(0.0, abs=1e-9)
    lifted[:, 0] = 0.51
    assert judged(joints=sliding, foot_contact=lifted)["total"] == pytest.approx(1.0)
    rising = person().human.joints
    rising[:, FEET, 2] += 0.001 * np.arange(FRAMES)[:, None]
    assert judged(joints=rising)["skate_cm_s"] == 0.0


def test_a_centimetre_inside_the_object_costs_one():
    depth = np.where(np.arange(FRAMES) < 10, 0.08, 0.0)
    assert judged(depth=depth)["total"] == pytest.approx(2.0)


def test_feet_that_are_off_the_floor_for_half_the_time_cost_five():
    floats = person().human.joints
    floats[20:, FEET, 2] += 0.061
    found = judged(joints=floats)
    assert found["floating"] == 0.5
    assert found["total"] - 0.02 * found["jerk_m_s3"] == pytest.approx(5.0)
    floats[:, TOES[0], 2] = 0.05  # the left toes stay
    assert judged(joints=floats)["floating"] == 0.0
    tiptoe = person().human.joints
    tiptoe[20:, FEET, 2] += 0.059
    assert judged(joints=tiptoe)["floating"] == 0.0


def test_fifty_metres_a_cubic_second_of_jerk_cost_one():
    t = np.arange(FRAMES) / FPS
    hurried = person().human.joints
    hurried[:, 22] += 200.0 * t[:, None] ** 3 * np.array([1.0, 0.0, 0.0])
    found = judged(joints=hurried)
    # 6 x 200 m/s3 of one of 24 joints.
    assert found["jerk_m_s3"] == pytest.approx(50.0)
    assert found["total"] - found["leaping"] == pytest.approx(1.0)


@pytest.mark.parametrize(("frames", "jerk"), [(3, 0.0), (4, 50.0)])
def test_four_frames_have_a_jerk(frames: int, jerk: float):
    t = np.arange(frames) / FPS
    joints = person().human.joints[:frames]
    joints[:, 22, 0] += 200.0 * t**3
    parts = {name: value[:frames] for name, value in vars(person().human).items()}
    human = HumanMotion(**{**parts, "joints": joints})
    short = Person(human, (), np.zeros((frames, 2)), np.zeros(frames))
    assert score(short, np.zeros(frames, bool))["jerk_m_s3"] == pytest.approx(jerk)


def test_a_frame_at_twice_a_limit_costs_one():
    leap = person().human.joints
    leap[20:, 22, 0] += 2 * 5.0 / FPS
    found = judged(joints=leap)
    assert found["leaping"] == pytest.approx(1.0)
    assert found["total"] - 0.02 * found["jerk_m_s3"] == pytest.approx(1.0)
