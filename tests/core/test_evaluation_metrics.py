"""The measures, on motions whose answer is known."""

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.body.model import load_body
from omomo_core.geometry.object_features import object_features
from omomo_core.learning.evaluation.metrics import (
    clusters,
    contact_scores,
    floor_height,
    foot_measures,
    joint_errors,
    onset_errors,
    root_orientation_errors,
    swing_measures,
)
from omomo_core.learning.evaluation.protocols import opposed_palms
from omomo_core.learning.evaluation.truth import Touching
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion

UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def box(frames: int, size: tuple[float, float, float] = (0.4, 0.4, 0.4)) -> ObjectMotion:
    solid = trimesh.creation.box(size)
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box")
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, 2, 3] = 1.0
    return ObjectMotion(mesh, T, np.ones(frames, bool))


@given(st.tuples(*[st.floats(-3, 3)] * 3), st.integers(0, 1000))
def test_moving_a_person_is_an_error_of_root_and_hands_but_not_of_pose(way, seed: int):
    true = np.random.default_rng(seed).normal(size=(7, 24, 3))
    found = joint_errors(true + np.array(way), true)
    length = 100 * np.linalg.norm(way)
    assert found["mpjpe_cm"] == pytest.approx(0, abs=1e-9)
    assert found["t_root_cm"] == pytest.approx(length, abs=1e-9)
    assert found["hand_jpe_cm"] == pytest.approx(length, abs=1e-9)


def test_mpjpe_counts_all_24_joints():
    true = np.zeros((5, 24, 3))
    found = true.copy()
    found[:, 4, 2] = 0.24
    assert joint_errors(found, true)["mpjpe_cm"] == pytest.approx(1.0)


@given(st.floats(0, np.pi))
def test_orientation_error_grows_with_the_angle_alone(angle: float):
    R = Rotation.from_rotvec([0, 0, angle]).as_matrix()[None]
    expected = 2 * np.sqrt(2) * np.sin(angle / 2)
    found = root_orientation_errors(R @ UPRIGHT, UPRIGHT[None])
    assert found["o_root"] == pytest.approx(expected, abs=1e-9)
    assert found["o_root_deg"] == pytest.approx(np.degrees(angle), abs=1e-4)


def test_contact_scores_of_some_hand_and_of_each():
    found = np.array([[1, 0], [1, 0], [0, 0], [0, 0]], bool)
    true = np.array([[0, 1], [1, 0], [0, 1], [0, 0]], bool)
    scores = contact_scores(found, true)
    assert scores["contact_precision"] == 1.0
    assert scores["contact_recall"] == pytest.approx(2 / 3)
    assert scores["contact_f1"] == pytest.approx(0.8)
    assert scores["left_contact_f1"] == pytest.approx(2 / 3)
    assert scores["right_contact_f1"] == 0.0
    assert contact_scores(~true & true, true & ~true)["contact_f1"] == 0.0


def test_the_onset_of_a_hand_counts_where_it_touches_in_both():
    found, true = np.zeros((2, 60, 2), bool)
    found[12:, 0] = true[30:, 0] = true[5:, 1] = True
    assert onset_errors(found, true) == {"left_onset_error_s": pytest.approx(0.6)}
    found[8:20, 1] = True
    assert onset_errors(found, true)["right_onset_error_s"] == pytest.approx(0.1)


@given(st.floats(0.01, 0.2))
def test_swings_are_as_high_as_toes_rise_in_steps(top: float):
    joints = np.zeros((60, 24, 3))
    step = np.sin(np.linspace(0, np.pi, 16))
    for foot, first in ((10, 5), (11, 30)):
        joints[first : first + 16, foot, 2] = top * step
        joints[first : first + 16, foot, 0] = np.linspace(0, 0.6, 16)
        joints[first + 16 :, foot, 0] = 0.6
    found = swing_measures(joints)
    assert found["toe_swing_cm"] == pytest.approx(100 * top, rel=0.02)
    if abs(top - 0.03) > 0.001:
        assert found["toe_skimming_share"] == float(top < 0.03)


def test_people_who_stand_have_no_swings():
    assert swing_measures(np.random.default_rng(0).normal(0, 0.002, (60, 24, 3))) == {}


@given(st.lists(st.floats(0, 0.1), max_size=40))
def test_clusters_share_out_every_value_and_keep_the_far_apart(values: list[float]):
    ordered = np.sort(np.array(values, float))
    found = clusters(ordered)
    assert sorted(np.concatenate([*found, []])) == list(ordered)
    groups = np.concatenate([np.full(20, 0.02), np.full(9, 0.09)])
    assert [len(c) for c in clusters(groups)] == [20, 9]


def test_the_last_frame_stands_as_the_one_before_it():
    # Three frames in which the toes stand are a cluster only with the last of them.
    joints = np.zeros((4, 24, 3))
    joints[:, 10:12, 2] = np.array([0.5, 0.1, 0.1, 0.1])[:, None]
    joints[:, 11, 2] += np.arange(4)
    assert floor_height(joints) == pytest.approx(0.1)


def test_sliding_is_measured_above_the_persons_own_floor():
    joints = np.zeros((60, 24, 3))
    joints[:, 7:9, 2], joints[:, 10:12, 2] = 0.31, 0.30
    assert floor_height(joints) == pytest.approx(0.30)
    assert foot_measures(joints)["foot_sliding_cm"] == 0.0
    joints[:, :, 0] = np.linspace(0, 0.2, 60)[:, None]
    assert foot_measures(joints)["foot_sliding_cm"] == pytest.approx(0.2 / 59 * 100, rel=0.1)
    assert foot_measures(joints)["toe_skating_cm_s"] == pytest.approx(20 / 59 * 30)
    joints[30:, 10, 2] += 0.2
    joints[:30, 10, 2] += 0.1
    assert foot_measures(joints)["foot_sliding_cm"] < 0.2 / 59 * 80


def test_touching_needs_no_vertices_near_the_palm():
    palms = np.array([[[0.24, 0, 1], [0.26, 0, 1]]])
    np.testing.assert_array_equal(Touching(box(1)).palms(palms), [[True, False]])


def standing(at: float) -> HumanMotion:
    body, frames = load_body(), 3
    root = np.tile([at, 0.0, float(body.rest_joints[0, 1])], (frames, 1))
    return HumanMotion(
        root=root,
        rotations=np.tile(UPRIGHT, (frames, 22, 1, 1)),
        fingers=body.relaxed_fingers.expand(frames, 30, 3, 3).double().numpy(),
        joints=np.zeros((frames, 24, 3)),
        hand_contact=np.zeros((frames, 2)),
        foot_contact=np.zeros((frames, 4)),
    )


@pytest.mark.parametrize("size", [0.3, 3.0])
def test_penetration_is_in_true_metres_whatever_the_size_of_the_object(size: float):
    # A wall whose face is 12 cm behind the middle of the pelvis' region, then far away.
    motion = box(3, (size, size, size))
    motion.T_world_object[:, 2, 3] = 1.0
    clear = Touching(motion).penetration(standing(5.0), load_body())
    assert set(clear.values()) == {0}
    motion.T_world_object[:, 1, 3] = size / 2
    deep = Touching(motion).penetration(standing(0.0), load_body())
    assert 6 < deep["penetration_cm"] < 18
    assert deep["body_collision_share"] == 1.0
    assert (deep["hand_penetration_cm"] > 0) == (size > 1)


def test_a_sheet_has_no_inside():
    motion = box(3, (2, 2, 2))
    keep = np.abs(np.asarray(motion.mesh.vertices)[motion.mesh.faces][..., 1] - 1).max(axis=1) < 0.1
    sheet = ObjectMesh(motion.mesh.vertices, motion.mesh.faces[keep], "sheet")
    motion = ObjectMotion(sheet, motion.T_world_object, motion.valid)
    motion.T_world_object[:, 1, 3] = -0.7
    assert Touching(motion).penetration(standing(0.0), load_body())["penetration_cm"] == 0


def test_guessed_palms_are_on_opposite_sides_and_let_go_at_rest():
    motion = box(60)
    motion.T_world_object[30:, 0, 3] = np.arange(30) / 30
    guesses = opposed_palms(object_features(motion), 8, np.random.default_rng(0))
    for guess in guesses:
        apart = np.linalg.norm(guess.palms[:, 0] - guess.palms[:, 1], axis=-1)
        assert (apart > 0.35).all()
        assert not guess.contact[:25].any()
        assert guess.contact[35:].all()
    sides = {tuple(np.round(g.palms[0, 0], 1)) for g in guesses}
    assert len(sides) > 2
    again = opposed_palms(object_features(motion), 8, np.random.default_rng(0))
    np.testing.assert_array_equal(again[7].palms, guesses[7].palms)
