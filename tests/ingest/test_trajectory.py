"""Phone poses become object poses; jumps, gaps and freezes split a take, and nothing is smoothed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.mount import Mount, identity_mount
from ingest.session import CaptureSession
from ingest.trajectory.object_motion import to_object_motion
from ingest.trajectory.segments import cut, find_breaks, same_world, segments
from ingest.trajectory.smooth import resample
from ingest.trajectory.trajectory_config import Reading
from omomo_core.errors import InputError
from omomo_core.motion import FPS


@pytest.fixture(scope="module")
def wander(wander):
    """Without the accelerometer, which is made of random numbers and points nowhere."""
    return lambda *args, **how: replace(wander(*args, **how), imu=None)


def _moved(session, first: int, T: np.ndarray):
    """The session with a constant transform on every pose from `first` on: a relocalisation."""
    poses = session.T_world_phone.copy()
    poses[first:] = T @ poses[first:]
    return replace(session, T_world_phone=poses)


def _shift(x: float) -> np.ndarray:
    T = np.eye(4)
    T[0, 3] = x
    return T


def test_a_clean_take_is_one_segment(wander, box):
    session = wander(0, seconds=4.0)
    take = to_object_motion(session, box, identity_mount(), Reading(floor=-1.0))
    assert take.segments == ((0, 121),)
    assert take.notes == ()
    assert take.motion.valid.all()


def test_frames_and_worlds_are_those_of_the_definition(wander, box):
    session = wander(1)
    T_phone_object = np.eye(4)
    T_phone_object[:3, :3] = Rotation.from_rotvec([0.3, -1.0, 0.5]).as_matrix()
    T_phone_object[:3, 3] = [0.1, -0.4, 0.2]
    take = to_object_motion(session, box, Mount(T_phone_object, "test"), Reading(floor=-1.25))
    np.testing.assert_allclose(take.motion.T_world_object[0, :2, 3], 0, atol=1e-12)
    for frame in (0, 17, 90):
        T_arkit_object = session.T_world_phone[2 * frame] @ T_phone_object
        expected = take.T_world_arkit @ T_arkit_object
        np.testing.assert_allclose(take.motion.T_world_object[frame], expected, atol=1e-9)
        height_above_floor = T_arkit_object[1, 3] + 1.25
        assert take.motion.T_world_object[frame, 2, 3] == pytest.approx(height_above_floor)
    np.testing.assert_allclose(take.T_world_arkit[:3, :3] @ [0, 1, 0], [0, 0, 1], atol=1e-12)


@settings(max_examples=20)
@given(first=st.integers(70, 170), sign=st.sampled_from([-1, 1]))
def test_a_half_metre_jump_splits_exactly_there(wander, box, first: int, sign: int):
    session = _moved(wander(2, seconds=4.0), first, _shift(0.5 * sign))
    assert np.flatnonzero(find_breaks(session).jumps).tolist() == [first - 1]
    take = to_object_motion(session, box, identity_mount(), Reading(floor=-1.0))
    # One frame is given up: the first one after the last pose before the jump.
    lost = (first - 1) // 2 + 1
    assert take.segments == ((0, lost), (lost + 1, 121))
    assert "jump" in take.notes[0]
    steps = np.linalg.norm(np.diff(take.motion.T_world_object[:, :3, 3], axis=0), axis=1)
    good = take.motion.valid[1:] & take.motion.valid[:-1]
    assert steps[good].max() < 0.1


def test_small_jumps_and_turns_of_a_relocalisation(wander):
    session = wander(3)
    for T in (_shift(0.06), np.eye(4)):
        T = T.copy()
        if T[0, 3] == 0:
            T[:3, :3] = Rotation.from_euler("y", 8, degrees=True).as_matrix()
        jumped = _moved(session, 90, T)
        assert np.flatnonzero(find_breaks(jumped).jumps).tolist() == [89]


def test_one_wild_pose_is_cut_out(wander):
    session = wander(4)
    poses = session.T_world_phone.copy()
    poses[77, :3, 3] += [0, 0.7, 0]
    jumps = find_breaks(replace(session, T_world_phone=poses)).jumps
    assert np.flatnonzero(jumps).tolist() == [76, 77]


def test_an_object_put_down_hard_is_no_jump(wander):
    """1.5 m/s down, then dead still within one step."""
    session = wander(5)
    poses = np.tile(np.eye(4), (len(session.times), 1, 1))
    poses[:, 1, 3] = 1.5 * np.maximum(0, 1.0 - (session.times - session.times[0]))
    poses[:, :3, 3] += np.random.default_rng(0).normal(scale=3e-4, size=(len(poses), 3))
    assert not find_breaks(replace(session, T_world_phone=poses)).any.any()


def test_a_gap_is_masked_and_short_holes_are_bridged(wander, box):
    session = wander(6, seconds=4.0)

    def without(first: int, last: int):
        keep = np.ones(len(session.times), bool)
        keep[first:last] = False
        return replace(
            session,
            times=session.times[keep],
            T_world_phone=session.T_world_phone[keep],
            intrinsics=None,
            video_times=None,
        )

    take = to_object_motion(without(100, 103), box, identity_mount(), Reading(floor=-1.0))
    assert take.segments == ((0, 121),)
    take = to_object_motion(without(100, 131), box, identity_mount(), Reading(floor=-1.0))
    assert take.segments == ((0, 50), (66, 121))
    assert "Gap" in take.notes[0]
    assert "1.65 to 2.18 s" in take.notes[0]


def test_frozen_tracking_is_flagged_and_a_still_object_is_not(wander, box):
    session = wander(7, seconds=4.0)
    poses = session.T_world_phone.copy()
    poses[100:130] = poses[100]
    frozen = replace(session, T_world_phone=poses)
    assert np.flatnonzero(find_breaks(frozen).frozen).tolist() == list(range(100, 130))
    take = to_object_motion(frozen, box, identity_mount(), Reading(floor=-1.0))
    assert take.segments == ((0, 51), (66, 121))
    ease = np.clip((session.times - session.times[0] - 1) / 2, 0, 1)
    ease = ease**3 * (10 - 15 * ease + 6 * ease**2)
    poses = np.tile(np.eye(4), (len(session.times), 1, 1))
    poses[:, 0, 3] = ease
    assert not find_breaks(replace(session, T_world_phone=poses)).any.any()


def test_limited_tracking_that_the_app_logs_is_masked(wander, box):
    session = wander(8, seconds=4.0)
    ok = np.ones(len(session.times), bool)
    ok[80:120] = False
    take = to_object_motion(
        replace(session, tracking_ok=ok), box, identity_mount(), Reading(floor=-1.0)
    )
    assert take.segments == ((0, 40), (61, 121))
    assert "Limited tracking" in take.notes[0]


@pytest.mark.parametrize("rate", [1.0, 5.0, 10.0])
def test_a_log_too_sparse_to_be_a_motion(wander, box, rate: float):
    with pytest.raises(InputError) as caught:
        to_object_motion(wander(9, seconds=30.0, rate=rate), box, identity_mount())
    assert caught.value.code == "rate-too-low"
    assert f"{rate:g} poses a second" in caught.value.what


@pytest.mark.parametrize("rate", [12.0, 15.0, 24.0, 240.0])
def test_every_other_rate_is_a_whole_take(wander, box, rate: float):
    take = to_object_motion(wander(9, rate=rate), box, identity_mount(), Reading(floor=-1.0))
    assert take.segments == ((0, 91),)


def test_a_hopeless_take_is_an_error(wander, box):
    session = wander(9)
    ok = np.arange(len(session.times)) % 50 > 5
    with pytest.raises(InputError) as caught:
        to_object_motion(replace(session, tracking_ok=ok), box, identity_mount())
    assert caught.value.code == "tracking-broken"
    assert "limited tracking" in caught.value.what


@pytest.mark.parametrize("keep_rotation", [True, False])
@pytest.mark.parametrize("poses", [4, 60])
def test_poses_at_the_origin_amid_a_take_are_no_motion(
    wander, box, poses: int, keep_rotation: bool
):
    """What apps write while tracking is lost, be it for a moment or for long."""
    session = wander(10, seconds=6.0)
    T = session.T_world_phone.copy()
    T[150 : 150 + poses, :3, 3] = 0
    if not keep_rotation or poses > 4:
        T[150 : 150 + poses, :3, :3] = np.eye(3)
    take = to_object_motion(replace(session, T_world_phone=T), box, identity_mount())
    assert take.segments == ((0, 75), ((150 + poses) // 2 + (poses > 0), 181))
    # Nor do they count for the floor, which is a guess here.
    used = take.motion.T_world_object[slice(*take.segments[take.chosen])]
    bottom = (used[:, 2, :3] @ box.vertices.T).min(axis=1) + used[:, 2, 3]
    middle = np.median(used[:, 2, :3] @ box.vertices.mean(axis=0) + used[:, 2, 3])
    assert middle == pytest.approx(1.0) or bottom.min() == pytest.approx(0.0, abs=1e-9)


def _rested(wander, jump: float, gap: float = 0.0):
    """Lifted from the floor and put down within six seconds; amid it the tracker's world rises."""
    session = wander(3, seconds=6.0)
    T, times = np.tile(session.T_world_phone[0], (361, 1, 1)), session.times.copy()
    lift = np.sin(np.pi * np.clip((np.arange(361) - 80) / 200, 0, 1)) ** 2
    T[:, :3, 3] += np.outer(lift, [0.2, 0.5, 0.1])
    T[:, :3, 3] += np.random.default_rng(0).normal(scale=2e-4, size=(len(T), 3))
    T[180:, 1, 3] += jump
    times[180:] += gap
    return replace(session, T_world_phone=T, times=times, video_times=times, imu=None)


@pytest.mark.parametrize("segment", [1, 2])
def test_each_segment_has_the_floor_under_it(wander, box, segment: int):
    jumped = to_object_motion(_rested(wander, 0.2), box, identity_mount(), Reading(segment=segment))
    assert len(jumped.segments) == 2
    assert jumped.chosen == segment - 1
    assert jumped.floor.source == "rest"
    start, stop = jumped.segments[jumped.chosen]
    T = jumped.motion.T_world_object[start:stop]
    bottom = (T[:, 2, :3] @ box.vertices.T).min(axis=1) + T[:, 2, 3]
    resting = bottom[5:30] if segment == 1 else bottom[-30:-5]
    np.testing.assert_allclose(resting, 0, atol=0.005)


def test_a_segment_without_a_rest_has_no_certain_floor(wander, box):
    session = _rested(wander, 0.2)
    T = session.T_world_phone.copy()
    T[270:, 1, 3] += 0.3 * np.sin(np.arange(91) / 12) ** 2
    second = to_object_motion(
        replace(session, T_world_phone=T), box, identity_mount(), Reading(segment=2)
    )
    assert second.floor.source == "elsewhere"
    assert not second.floor.certain
    assert "‹segment›" in second.floor.message


def test_behind_a_gap_the_world_is_the_same_and_so_is_its_floor(wander, box):
    session = _rested(wander, 0.0, gap=0.4)
    T = session.T_world_phone.copy()
    T[270:, 1, 3] += 0.3 * np.sin(np.arange(91) / 12) ** 2
    held = replace(session, T_world_phone=T)
    assert to_object_motion(held, box, identity_mount(), Reading(segment=2)).floor.source == "rest"
    longer = session.times + np.where(np.arange(361) >= 180, 2.0, 0.0)
    paused = replace(held, times=longer, video_times=longer)
    assert (
        to_object_motion(paused, box, identity_mount(), Reading(segment=2)).floor.source != "rest"
    )


def test_the_wanted_segment_must_be_there(wander, box):
    with pytest.raises(InputError) as caught:
        to_object_motion(wander(0), box, identity_mount(), Reading(segment=2))
    assert caught.value.code == "segment-missing"


@pytest.mark.parametrize(("missing", "bridged"), [(8, True), (9, False)])
def test_a_hole_in_a_smooth_motion_is_bridged(box, missing: int, bridged: bool):
    """0.15 s at 60 Hz are nine steps; ten are too long."""
    times = np.arange(241) / 60
    T = np.tile(np.eye(4), (241, 1, 1))
    T[:, :3, 3] = np.outer(times, [0.3, 0.05, 0.1]) + 0.02 * np.sin(times)[:, None]
    keep = np.r_[:100, 100 + missing : 241]
    session = CaptureSession("test", Path("x"), times[keep], T[keep])
    take = to_object_motion(session, box, identity_mount(), Reading(floor=-1.0))
    assert (len(take.segments) == 1) == bridged
    assert any("bridged" in note for note in take.notes) == bridged


def test_a_hole_in_which_the_motion_bends_splits(box):
    times = np.arange(241) / 60
    T = np.tile(np.eye(4), (241, 1, 1))
    T[:, 0, 3] = np.abs(times - times[104]) * 0.8
    keep = np.r_[:100, 108:241]
    session = CaptureSession("test", Path("x"), times[keep], T[keep])
    take = to_object_motion(session, box, identity_mount(), Reading(floor=-1.0))
    assert len(take.segments) == 2


def test_segments_of_a_second_and_cut(wander, box):
    motion = to_object_motion(
        wander(0, seconds=4.0), box, identity_mount(), Reading(floor=-1.0)
    ).motion
    valid = motion.valid.copy()
    valid[[29, 60]] = False
    motion = replace(motion, valid=valid)
    assert segments(motion) == [(30, 60), (61, 121)]
    piece = cut(motion, 30, 60)
    assert piece.start_time == pytest.approx(1.0)
    assert piece.valid.all()
    np.testing.assert_array_equal(piece.T_world_object, motion.T_world_object[30:60])


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), rate=st.sampled_from([24.0, 30.0, 59.94, 120.0]))
def test_resampling_goes_by_time(wander, seed: int, rate: float):
    """Any rate and irregular stamps: the motion at 30 fps is the same motion."""
    session = wander(seed, rate=rate)
    rng = np.random.default_rng(seed)
    keep = rng.random(len(session.times)) > 0.15
    keep[0] = True
    times, T = session.times[keep], session.T_world_phone[keep]
    frames, valid = resample(times, T, np.diff(times) > 0.1)
    fine = wander(seed, rate=rate)
    grid = times[0] + np.arange(len(frames)) / FPS
    expected = np.stack(
        [np.interp(grid, fine.times, fine.T_world_phone[:, i, 3]) for i in range(3)], axis=1
    )
    np.testing.assert_allclose(frames[valid, :3, 3], expected[valid], atol=0.008)
    np.testing.assert_allclose(np.linalg.det(frames[:, :3, :3]), 1, atol=1e-9)


def test_the_world_changes_with_the_pose_after_a_jump(wander):
    session = replace(wander(0, seconds=6.0), imu=None)
    T = session.T_world_phone.copy()
    T[182:, 1, 3] += 0.5  # the step from pose 181 to 182; frame 91 is pose 182
    jumped = replace(session, T_world_phone=T)
    after = same_world(session.times, find_breaks(jumped), (100, 180), 181)
    np.testing.assert_array_equal(np.flatnonzero(after), np.arange(91, 181))
