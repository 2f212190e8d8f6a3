"""Rest poses of other skeletons: limbs along ours, feet flat, shoulders where ours are."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import (
    ANKLES,
    COLLARS,
    LIMBS,
    forward_kinematics,
    rest_offsets,
    rest_turns,
)
from omomo_core.body.model import load_body
from omomo_core.skeleton import MODEL_ABOVE, MODEL_PARENTS

BODY = load_body()
OURS = rest_offsets(BODY)
ABOVE = list(MODEL_ABOVE)
SHRUG = {13: 0.0, 14: 0.0, 16: 0.9, 17: -0.9}
"""Radians about the forward axis by which SMPL's shoulders are higher at rest, about."""


def as_if_ours(theirs: np.ndarray) -> np.ndarray:
    """Their skeleton where every rotation of ours is the identity: joints from the pelvis."""
    bones = np.einsum("jyx,jy->jx", rest_turns(BODY, theirs)[ABOVE], theirs)
    at = np.zeros((24, 3))
    for j in range(1, 24):
        at[j] = at[MODEL_PARENTS[j]] + bones[j]
    return at


def off(a: np.ndarray, b: np.ndarray) -> float:
    """Degrees between two directions."""
    cosine = a @ b / np.linalg.norm(a) / np.linalg.norm(b)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def shrugging() -> np.ndarray:
    theirs = OURS.copy()
    for j, angle in SHRUG.items():
        theirs[j] = Rotation.from_rotvec([0, 0, angle]).apply(theirs[j])
    return theirs


def test_our_own_skeleton_is_not_turned():
    np.testing.assert_allclose(rest_turns(BODY, OURS), np.tile(np.eye(3), (22, 1, 1)), atol=1e-7)


@given(st.integers(0, 2**32 - 1), st.floats(0.5, 2.0))
def test_limbs_end_up_along_ours_whatever_the_rest_pose(seed: int, size: float):
    random = Rotation.random(24, random_state=np.random.default_rng(seed))
    theirs = size * random.apply(OURS)
    at = as_if_ours(theirs)
    for start, end in LIMBS.items():
        level = [1.0, 0.0, 1.0] if start in ANKLES else 1.0
        assert off((at[end] - at[start]) * level, OURS[end] * level) < 1e-3
    lengths = np.linalg.norm(at - at[ABOVE], axis=1)
    np.testing.assert_allclose(lengths, np.linalg.norm(theirs, axis=1), atol=1e-9)


def test_a_foot_that_stands_flat_stands_flat_whatever_its_ankle_height():
    theirs = OURS.copy()
    for foot, turned_out in ((10, 0.3), (11, -0.2)):
        theirs[foot] = Rotation.from_rotvec([0.0, turned_out, 0.0]).apply(theirs[foot])
        theirs[foot, 1] -= 0.02
    bones = np.einsum("jyx,jy->jx", rest_turns(BODY, theirs)[ABOVE], theirs)
    for foot in (10, 11):
        np.testing.assert_allclose(bones[foot, 1], theirs[foot, 1], atol=1e-9)
        assert off(bones[foot] * [1, 0, 1], OURS[foot] * [1, 0, 1]) < 1e-3
    np.testing.assert_allclose(
        rest_turns(BODY, theirs)[ANKLES[0]] @ [0, 1, 0], [0, 1, 0], atol=1e-9
    )


def test_raised_shoulders_come_down_to_where_ours_are():
    at, raised = as_if_ours(shrugging()), np.zeros((24, 3))
    for j in range(1, 24):
        raised[j] = raised[MODEL_PARENTS[j]] + shrugging()[j]
    for collar, shoulder in COLLARS.items():
        ours = OURS[collar] + OURS[shoulder]
        assert off(raised[shoulder] - raised[9], ours) > 15
        np.testing.assert_allclose(at[shoulder] - at[9], ours, atol=1e-6)


def test_a_shoulder_too_near_its_collar_comes_as_near_as_it_can():
    theirs = OURS.copy()
    theirs[13] += [0.3, 0.0, 0.0]
    theirs[16] *= 0.2
    at = as_if_ours(theirs)
    assert np.isfinite(at).all()
    line = OURS[13] + OURS[16]
    beside = at[16] - at[9] - (at[16] - at[9]) @ line / (line @ line) * line
    collar = theirs[13] - theirs[13] @ line / (line @ line) * line
    assert np.linalg.norm(beside) == pytest.approx(
        np.linalg.norm(collar) - np.linalg.norm(theirs[16]), abs=1e-6
    )


def test_turned_poses_give_the_joints_of_the_other_skeleton_back():
    """R @ turn on our terms moves turn^T @ offset as R moves the offset."""
    theirs = shrugging()
    R = Rotation.random(22, random_state=np.random.default_rng(1)).as_matrix()
    turns = rest_turns(BODY, theirs)
    bones = np.einsum("jyx,jy->jx", turns[ABOVE], theirs)
    np.testing.assert_allclose(
        np.einsum("jxy,jy->jx", (R @ turns)[ABOVE], bones),
        np.einsum("jxy,jy->jx", R[ABOVE], theirs),
        atol=1e-9,
    )


def test_offsets_are_those_of_the_body():
    joints = forward_kinematics(BODY, torch.zeros(3), torch.eye(3).expand(22, 3, 3)).numpy()
    at = np.zeros((24, 3))
    for j in range(1, 24):
        at[j] = at[MODEL_PARENTS[j]] + OURS[j]
    np.testing.assert_allclose(at, joints, atol=1e-6)
