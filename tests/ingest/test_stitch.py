"""A jump of the tracker is one rigid transform: taken out, the motion goes on as it was."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.mount import identity_mount
from ingest.trajectory.object_motion import to_object_motion
from ingest.trajectory.segments import find_breaks, stitch_jumps
from ingest.trajectory.trajectory_config import Reading

NOISES = (0.0, 1e-4, 4e-4)


@pytest.fixture(scope="module")
def wander(wander):
    """Without the accelerometer, which is made of random numbers and points nowhere."""
    return lambda *args, **how: replace(wander(*args, **how), imu=None)


def _jumped(session, first: int, seed: int):
    """With a random rigid transform, well over the threshold, on every pose from `first` on."""
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    axis, direction = rng.normal(size=(2, 3))
    T[:3, :3] = Rotation.from_rotvec(axis / np.linalg.norm(axis) * rng.uniform(0, 1)).as_matrix()
    poses = session.T_world_phone.copy()
    at = poses[first, :3, 3].copy()
    shift = direction / np.linalg.norm(direction) * rng.uniform(0.1, 0.8)
    T[:3, 3] = at - T[:3, :3] @ at + shift
    poses[first:] = T @ poses[first:]
    return replace(session, T_world_phone=poses), float(np.linalg.norm(shift))


def _noisy(session, noise: float, seed: int):
    rng = np.random.default_rng(seed)
    poses = session.T_world_phone.copy()
    poses[:, :3, 3] += rng.normal(size=(len(poses), 3)) * noise
    turn = rng.normal(size=(len(poses), 3)) * noise * 2  # 0.05 deg with 0.4 mm
    poses[:, :3, :3] = poses[:, :3, :3] @ Rotation.from_rotvec(turn).as_matrix()
    return replace(session, T_world_phone=poses)


@settings(max_examples=30)
@given(
    seed=st.integers(0, 10**6),
    first=st.integers(20, 160),
    noise=st.sampled_from(NOISES),
)
def test_stitching_restores_the_motion(wander, seed: int, first: int, noise: float):
    clean = _noisy(wander(seed), noise, seed)
    session, shift = _jumped(clean, first, seed)
    moved, breaks, found = stitch_jumps(session, find_breaks(session))
    assert not breaks.any.any()
    assert [stitch.step for stitch in found] == [first - 1]
    assert found[0].metres == pytest.approx(shift, abs=0.002 + 8 * noise)
    off = moved.T_world_phone - clean.T_world_phone
    # The last pose before the jump and the first after it each carry the noise.
    assert np.abs(off[first, :3, 3]).max() < 1e-3 + 8 * noise
    # A turn that is wrong by the noise moves what is 1 m further on by so much.
    assert np.abs(off[:, :3, 3]).max() < 3e-3 + 25 * noise
    assert np.abs(off[:, :3, :3]).max() < 3e-3 + 16 * noise


def test_a_stitched_take_is_whole_and_says_so(wander, box):
    session, _ = _jumped(wander(1, seconds=4.0), 100, 1)
    split = to_object_motion(session, box, identity_mount(), Reading(floor=-1.0))
    assert len(split.segments) == 2
    take = to_object_motion(session, box, identity_mount(), Reading(floor=-1.0, stitch=True))
    assert take.segments == ((0, 121),)
    assert len(take.notes) == 1
    assert "1.65 s" in take.notes[0]
    clean = to_object_motion(wander(1, seconds=4.0), box, identity_mount(), Reading(floor=-1.0))
    np.testing.assert_allclose(take.motion.T_world_object, clean.motion.T_world_object, atol=5e-3)


def test_two_jumps_add_up(wander):
    clean = wander(2)
    session, _ = _jumped(_jumped(clean, 60, 5)[0], 120, 6)
    moved, _, found = stitch_jumps(session, find_breaks(session))
    assert [stitch.step for stitch in found] == [59, 119]
    np.testing.assert_allclose(moved.T_world_phone, clean.T_world_phone, atol=8e-3)


def test_only_clear_jumps_are_stitched(wander):
    """Not a wild pose, not what follows a gap or limited tracking, not the last pose."""
    session = wander(3)
    wild = session.T_world_phone.copy()
    wild[77, :3, 3] += [0, 0.7, 0]
    wild = replace(session, T_world_phone=wild)
    last, _ = _jumped(session, len(session.times) - 1, 0)
    lost, _ = _jumped(session, 90, 0)
    ok = np.ones(len(session.times), bool)
    ok[88:90] = False
    lost = replace(lost, tracking_ok=ok)
    late, _ = _jumped(session, 90, 0)
    times = late.times + np.where(np.arange(len(late.times)) >= 90, 0.3, 0)
    for broken in (wild, last, lost, replace(late, times=times)):
        breaks = find_breaks(broken)
        assert breaks.any.any()
        moved, left, found = stitch_jumps(broken, breaks)
        assert found == []
        np.testing.assert_array_equal(left.any, breaks.any)
        np.testing.assert_array_equal(moved.T_world_phone, broken.T_world_phone)
