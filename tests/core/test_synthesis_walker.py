"""Made-up base motions: feet stand where they are put, and the body goes where the path goes."""

import pickle
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body.kinematics import joints_of, sole_points
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import foot_contacts, foot_skating
from omomo_core.learning.recordings.recordings import build_mocap
from omomo_core.learning.synthesis.base_motion import BaseMotion, Footage, heading, survey
from omomo_core.learning.synthesis.walker.footsteps import Move, MoveName, draw_move, lay
from omomo_core.learning.synthesis.walker.improvise import MotionLibrary, follow, improvise, index
from omomo_core.motion import FPS

FRAMES = 240
PAUSES = [30, 25]


@cache
def library() -> MotionLibrary:
    """Standing at ease made by hand: no mocap is needed to step along a path."""
    body = load_body()
    flat = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    rotations = np.tile(flat, (60, 22, 1, 1))
    for side, j in ((1.0, (16, 18, 20)), (-1.0, (17, 19, 21))):
        c, s = np.cos(1.3), side * np.sin(1.3)
        rotations[:, j] = flat @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    height = float(body.rest_joints[0, 1] - body.vertices[:, 1].min())
    clip = Clip(
        name="standing",
        source="test",
        licence="free",
        root=np.tile([0.0, 0.0, height], (60, 1)),
        rotations=rotations,
        hand_contact=np.zeros((60, 2)),
        foot_contact=np.ones((60, 4)),
        object_motion=None,
    )
    return index(survey([clip], body), body)


@cache
def stages() -> list[BaseMotion]:
    made = [improvise(np.random.default_rng([5, k]), library(), FRAMES, PAUSES) for k in range(8)]
    return [base_motion for base_motion in made if base_motion is not None]


def test_nearly_every_try_succeeds() -> None:
    assert len(stages()) >= 7


def test_stages_have_the_length_and_stops_asked_for() -> None:
    for base_motion in stages():
        assert base_motion.root.shape == (FRAMES, 3)
        assert base_motion.sway.shape == (FRAMES, 5)
        assert [b - a for a, b in base_motion.pauses] == PAUSES
        (a, b), (c, d) = base_motion.pauses
        assert 0 <= a < b < c < d <= FRAMES
        np.testing.assert_allclose(np.linalg.det(base_motion.rotations), 1.0, atol=1e-6)


def test_there_is_movement_between_the_stops() -> None:
    for base_motion in stages():
        between = slice(base_motion.pauses[0][1], base_motion.pauses[1][0])
        moved = np.ptp(base_motion.root[between, :2], axis=0).max()
        assert moved > 0.05 or np.ptp(heading(base_motion.rotations)[between]) > 0.1


def test_people_walk_up_to_what_they_take_and_step_back_from_what_they_leave() -> None:
    """Where there is time for it: some wait where they are."""
    came, left = [], []
    for k in range(10):
        base_motion = improvise(np.random.default_rng([6, k]), library(), 200, [30])
        assert base_motion is not None
        first, last = base_motion.pauses[0]
        yaw = float(heading(base_motion.rotations)[first])
        ahead = base_motion.root[:, :2] @ [np.cos(yaw), np.sin(yaw)]
        if first > 50:
            came.append(ahead[first] - ahead[first - 50])
        if last < 150:
            left.append(ahead[last + 50] - ahead[last])
    assert min(len(came), len(left)) > 3
    assert np.median(came) > 0.2
    assert np.median(left) < -0.05


def test_nobody_moves_in_the_stops() -> None:
    body = load_body()
    for base_motion in stages():
        soles = sole_points(body, base_motion.root, base_motion.rotations)
        ankles = joints_of(body, base_motion.root, base_motion.rotations)[:, 7:9]
        for a, b in base_motion.pauses:
            assert (
                np.linalg.norm(np.diff(base_motion.root[a:b], axis=0), axis=-1).max() * FPS < 0.12
            )
            assert np.abs(np.diff(soles[a:b], axis=0)).max() * FPS < 0.05
            assert soles[a:b, :, 2].max() < 0.045
            assert np.linalg.norm(np.diff(ankles[a, :, :2], axis=0)) < 0.45


def test_feet_neither_slide_nor_sink_nor_cross() -> None:
    body = load_body()
    for base_motion in stages():
        soles = sole_points(body, base_motion.root, base_motion.rotations)
        assert foot_skating(soles, foot_contacts(soles)) < 0.03
        assert soles[..., 2].min() > -0.03
        ankles = joints_of(body, base_motion.root, base_motion.rotations)[:, 7:9]
        across = ((ankles[:, 0] - ankles[:, 1]) * base_motion.rotations[:, 0, :, 0]).sum(-1)
        assert across.min() > 0.0


def test_nothing_pops() -> None:
    body = load_body()
    for base_motion in stages():
        joints = joints_of(body, base_motion.root, base_motion.rotations)
        assert np.linalg.norm(np.diff(joints, 2, axis=0), axis=-1).max() * FPS**2 < 100.0


@settings(max_examples=15)
@given(st.sampled_from(["walk", "back", "side", "shuffle", "turn", "orbit"]), st.integers(0, 99))
def test_the_body_is_where_the_path_ends(name: MoveName, seed: int) -> None:
    rng = np.random.default_rng(seed)
    path = lay([20, draw_move(rng, {name: 1.0}), 45], start=(1.0, -2.0), yaw=2.5)
    root, rotations = follow(rng, library(), path)
    assert np.linalg.norm(root[-1, :2] - path.position[-1]) < 0.15
    off = heading(rotations) - path.heading
    off = (off + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(off).max() < np.radians(15)
    assert np.linalg.norm(root[:, :2] - path.position, axis=1).max() < 0.2


def test_a_path_has_the_length_and_turn_of_its_moves() -> None:
    straight = lay([5, Move("back", (-0.8, 0.0), 0.0, 50), 5], yaw=np.pi / 2)
    np.testing.assert_allclose(straight.position[-1], [0.0, -0.8], atol=1e-9)
    curve = lay([Move("walk", (1.0, 0.0), 0.7, 40, (0.2, 0.9))], yaw=0.1)
    assert curve.heading[-1] == pytest.approx(0.8)
    assert np.linalg.norm(np.diff(curve.position, axis=0), axis=1).sum() < 1.0
    assert len(curve.heading) == 40


def test_sideways_steps_lead_with_the_foot_on_that_side() -> None:
    body = load_body()
    for way, first in ((0.5, 0), (-0.5, 1)):
        path = lay([15, Move("side", (0.0, way), 0.0, 50), 40])
        root, rotations = follow(np.random.default_rng(0), library(), path)
        ankles = joints_of(body, root, rotations)[:, 7:9]
        moved = np.linalg.norm(ankles[..., :2] - ankles[0, :, :2], axis=-1) > 0.03
        assert moved[:, first].argmax() < moved[:, 1 - first].argmax()


def test_the_same_seed_gives_the_same_motion() -> None:
    one, two = (improvise(np.random.default_rng(3), library(), 120, [30]) for _ in range(2))
    assert one is not None
    assert two is not None
    np.testing.assert_array_equal(one.root, two.root)


def test_no_time_to_move_gives_nothing() -> None:
    assert improvise(np.random.default_rng(0), library(), 70, [30, 30]) is None


def test_nobody_standing_is_refused() -> None:
    with pytest.raises(InputError) as error:
        index(Footage([], np.zeros(0)), load_body())
    assert error.value.code == "walker-standing"


def test_mocap_gives_a_small_library(shared: Path) -> None:
    body = load_body()
    clips = build_mocap(shared / "data/mocap/cmu_bvh/13", body)
    real = index(survey(clips, body), body)
    assert len(pickle.dumps(real)) < 8_000_000
    assert "mocap.cs.cmu.edu" in real.licence
    assert improvise(np.random.default_rng(1), real, FRAMES, PAUSES) is not None
