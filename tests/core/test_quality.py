"""Checks of clips: each fault is seen, and a good pose raises none."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.body.model import load_body
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.quality import SIDES, elbow, judge, knee, twist
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.skeleton import joint

BODY = load_body()
FRAMES = 30
UPRIGHT = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""Facing world x, z up."""


def turned(axis: str, degrees: float) -> np.ndarray:
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


def standing(box: np.ndarray, size: tuple[float, float, float] = (0.3, 0.3, 0.4)) -> Clip:
    """Somebody in a slightly bent stance, arms hanging, and a box at a place per frame."""
    local = np.tile(np.eye(3), (22, 1, 1))
    for side, away in (("left", -1.0), ("right", 1.0)):
        arm = turned("z", 80.0 * away)
        local[joint(f"{side}_shoulder")] = arm
        for below in ("elbow", "wrist"):
            local[joint(f"{side}_{below}")] = arm @ turned("y", 20.0 * away)
    rest = BODY.rest_joints.double().numpy()
    height = rest[0, 1] - float(BODY.vertices[:, 1].min())
    solid = trimesh.creation.box(size)
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, 3] = box
    return Clip(
        name="standing",
        source="test",
        licence="CC0",
        root=np.tile([0.0, 0.0, height], (FRAMES, 1)),
        rotations=np.tile(UPRIGHT @ local, (FRAMES, 1, 1, 1)),
        hand_contact=np.zeros((FRAMES, 2)),
        foot_contact=np.ones((FRAMES, 4)),
        object_motion=ObjectMotion(
            ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "box"),
            T,
            np.ones(FRAMES, bool),
        ),
    )


AHEAD = np.array([1.0, 0.0, 0.2])


def test_a_calm_stance_beside_a_resting_box_has_no_flags():
    quality = judge(standing(AHEAD), BODY)
    assert quality.flags == ()
    assert quality.rest_height_cm == pytest.approx(0.0, abs=1e-6)


def test_a_box_that_moves_by_itself_floats_and_a_held_one_does_not():
    rise = AHEAD + np.linspace(0, 1, FRAMES)[:, None] * [0.0, 0.0, 0.8]
    free = standing(rise)
    held = replace(free, hand_contact=np.ones((FRAMES, 2)))
    assert judge(free, BODY).floating_frames > 20
    assert judge(held, BODY).floating_frames == 0
    assert "palm off" in judge(held, BODY).flags


def test_a_box_on_one_edge_topples():
    clip = standing(AHEAD)
    assert clip.object_motion is not None
    T = clip.object_motion.T_world_object.copy()
    T[:, :3, :3] = turned("x", 20.0)
    tilted = replace(clip, object_motion=replace(clip.object_motion, T_world_object=T))
    assert "topples" in judge(tilted, BODY).flags


@pytest.mark.parametrize(
    ("place", "part"),
    [([0.0, 0.0, 1.2], "trunk"), ([0.05, 0.09, 0.45], "leg"), ([0.0, 0.33, 1.15], "arm")],
)
def test_a_box_through_the_body_is_seen_where_it_is(place: list[float], part: str):
    thin = standing(np.array(place), (0.5, 0.3, 0.02) if part == "arm" else (0.5, 0.02, 0.3))
    depth = {p: getattr(judge(thin, BODY), f"{p}_depth_cm") for p in ("trunk", "leg", "arm")}
    assert depth[part] > 2.0
    assert depth[part] == max(depth.values())


def test_a_box_below_the_floor_is_flagged():
    assert "under floor" in judge(standing(AHEAD - [0.0, 0.0, 0.1]), BODY).flags


def test_gliding_feet_are_flagged():
    clip = standing(np.array([3.0, 0.0, 0.2]))
    away = np.linspace(0, 1, FRAMES)[:, None] * [0.5, 0.0, 0.0]
    quality = judge(replace(clip, root=clip.root + away), BODY)
    assert "skates" in quality.flags
    assert quality.skating_cm_s == pytest.approx(50.0, rel=0.1)


def test_broken_joints_are_flagged():
    clip = standing(AHEAD)
    back = clip.rotations.copy()
    for name in ("left_elbow", "left_wrist"):
        back[:, joint(name)] = back[:, joint(name)] @ turned("y", 80.0)
    assert "elbow broken" in judge(replace(clip, rotations=back), BODY).flags
    back = clip.rotations.copy()
    for name in ("right_knee", "right_ankle", "right_foot"):
        back[:, joint(name)] = back[:, joint(name)] @ turned("x", -40.0)
    assert "knee broken" in judge(replace(clip, rotations=back), BODY).flags


@given(flexion=st.floats(-80, 170), world=st.integers(0, 1000))
def test_hinges_measure_flexion_wherever_the_limb_points(flexion: float, world: int):
    R = Rotation.random(rng=np.random.default_rng(world)).as_matrix()
    rotations = np.tile(R, (2, 22, 1, 1))
    for side, away in zip(SIDES, (-1.0, 1.0), strict=True):
        rotations[:, joint(f"{side}_elbow")] = R @ turned("y", away * flexion)
        rotations[:, joint(f"{side}_knee")] = R @ turned("x", flexion)
    for side in SIDES:
        for hinge in (elbow(rotations, side), knee(rotations, side)):
            np.testing.assert_allclose(hinge.flexion, flexion, atol=1e-6)
            np.testing.assert_allclose(hinge.aside, 0.0, atol=1e-6)


@given(about=st.floats(-175, 175), swing=st.floats(-80, 80))
def test_twist_is_the_turn_about_the_bone_whatever_the_swing(about: float, swing: float):
    rotations = np.tile(np.eye(3), (1, 22, 1, 1))
    rotations[:, joint("left_shoulder")] = turned("z", swing) @ turned("x", about)
    measured = twist(rotations, "left_shoulder", "left_collar")
    np.testing.assert_allclose(measured, about, atol=1e-6)
