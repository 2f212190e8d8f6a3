"""Bodies, hands, feet and limbs that choose one side of the object: clear of it, and steady."""

from itertools import pairwise, product

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.limbs import reach
from omomo_core.body.trajectory_optimization.obstacle import MeshObstacle
from omomo_core.body.trajectory_optimization.residuals import (
    InteractionTargets,
    build_anatomy,
    penetration_depth,
)
from omomo_core.generation.collision.avoidance import (
    CollisionAvoidance,
    level_shifts,
    move_feet_clear,
    move_root_clear,
    swing_limbs_clear,
    turn_hands_clear,
)
from omomo_core.generation.collision.collision_config import ROOT_SHIFT
from omomo_core.generation.solving.bodies import solve_bodies
from omomo_core.generation.solving.foot_plan import ANKLES, FootPlan
from omomo_core.generation.solving.solving_config import BODY_SOLVING
from omomo_core.geometry.cheapest_path import cheapest_path
from omomo_core.geometry.runs import runs
from omomo_core.skeleton import joint
from tests.core.standing_people import BODY, FRAMES, Pose, at, block, standing


def wish_of(
    pose: Pose, obstacle: MeshObstacle, hold: float = 0.0, T: np.ndarray | None = None
) -> InteractionTargets:
    palms = forward_kinematics(BODY, *pose)[..., 22:, :]
    return InteractionTargets(
        palms=palms,
        hold=torch.full((1, FRAMES, 2), hold),
        R_world_wrist=pose[1][:, :, WRISTS],
        T_world_object=at() if T is None else T,
        obstacle=obstacle,
        balance=np.ones(FRAMES),
    )


def around(targets: InteractionTargets, free: torch.Tensor | None = None) -> CollisionAvoidance:
    flesh = build_anatomy(BODY, clearance=BODY_SOLVING.clearance)
    free = torch.ones(FRAMES) if free is None else free
    return CollisionAvoidance.of(flesh, targets.obstacle.field, targets.T_world_object, free)


def deepest(pose: Pose, targets: InteractionTargets) -> float:
    T = torch.from_numpy(targets.T_world_object)
    return float(penetration_depth(BODY, *pose, T, targets.obstacle)[:, 5:-5].max())


def solved(pose: Pose, targets: InteractionTargets, planted: float = 1.0) -> Pose:
    out = solve_bodies(BODY, *pose, torch.full((1, FRAMES, 4), planted), targets)
    return out.root, out.rotations


@settings(max_examples=15)
@given(seed=st.integers(0, 99), steps=st.integers(1, 5), choices=st.integers(1, 3))
def test_the_cheapest_course_is_the_least_of_all(seed: int, steps: int, choices: int):
    rng = np.random.default_rng(seed)
    cost = torch.from_numpy(rng.random((2, steps, choices))).float()
    between = torch.from_numpy(rng.random((2, steps - 1, choices, choices))).float()

    def total(k: int, path: tuple[int, ...]) -> float:
        own = sum(float(cost[k, t, c]) for t, c in enumerate(path))
        return own + sum(float(between[k, t, a, b]) for t, (a, b) in enumerate(pairwise(path)))

    found = cheapest_path(cost, between)
    for k in range(2):
        least = min(total(k, path) for path in product(range(choices), repeat=steps))
        assert total(k, tuple(found[k].tolist())) == pytest.approx(least, abs=1e-5)


def test_shifts_begin_with_none_and_stay_on_the_level():
    tried = level_shifts(0.05, 0.2)
    assert not tried[0].any()
    assert not tried[:, 2].any()
    assert float(tried.norm(dim=-1).max()) == pytest.approx(0.2)
    assert len(tried.unique(dim=0)) == len(tried)


@pytest.mark.parametrize("edge", [-0.05, 0.0, 0.05])
def test_thighs_across_a_thin_top_come_out_on_one_side(edge: float):
    pose = standing()
    targets = wish_of(pose, block((edge, -0.6, 0.7), (0.9, 0.6, 0.73)))
    assert deepest(pose, targets) > 0.03
    out = solved(pose, targets)
    assert deepest(out, targets) < 0.003
    assert float((out[0] - pose[0]).norm(dim=-1).max()) < ROOT_SHIFT.farthest + 0.1


def test_a_body_half_inside_a_table_ends_clear_with_its_feet_on_the_floor():
    pose = standing()
    targets = wish_of(pose, block((-0.02, -0.6, 0.0), (0.8, 0.6, 0.75)))
    assert deepest(pose, targets) > 0.08
    out = solved(pose, targets)
    assert deepest(out, targets) < 0.003
    ankles = forward_kinematics(BODY, *out)[..., ANKLES, :]
    assert float(ankles.diff(dim=1).norm(dim=-1).max()) < 1e-3
    before = forward_kinematics(BODY, *pose)[..., ANKLES, 2]
    torch.testing.assert_close(ankles[..., 2], before, atol=5e-3, rtol=0)


def test_a_forearm_across_a_board_swings_to_one_side_and_the_palm_stays():
    root, R = standing()
    palms = torch.tensor([[0.4, 0.25, 1.1], [0.4, -0.25, 1.1]]).expand(1, FRAMES, 2, 3)
    for side, arm in enumerate(("left_arm", "right_arm")):
        R, _ = reach(BODY, root, R, arm, palms[..., side, :])
    joints = forward_kinematics(BODY, root, R)
    elbow = joints[0, 0, joint("left_elbow")].numpy()
    # A thin upright board into which the left elbow sticks.
    corners = elbow + np.array([[-0.1, -0.02, -0.3], [0.1, 0.0, 0.02]])
    board = block(*map(tuple, corners))
    targets = wish_of((root, R), board, hold=1.0)
    assert deepest((root, R), targets) > 0.02
    swung = swing_limbs_clear(BODY, root, R, around(targets))
    # The side is chosen in coarse steps; what is left the polish pushes out of it.
    assert deepest((root, swung), targets) < 0.006
    after = forward_kinematics(BODY, root, swung)
    torch.testing.assert_close(after[..., 22:, :], joints[..., 22:, :], atol=1e-4, rtol=0)
    torch.testing.assert_close(after[..., 19, :], joints[..., 19, :], atol=1e-5, rtol=0)


def test_a_hand_turns_about_its_palm_to_free_its_wrist():
    root, R = standing()
    R, _ = reach(BODY, root, R, "left_arm", torch.tensor([0.35, 0.2, 1.1]).expand(1, FRAMES, 3))
    joints = forward_kinematics(BODY, root, R)
    wrist = joints[0, 0, WRISTS[0]].numpy()
    targets = wish_of((root, R), block(tuple(wrist - 0.015), tuple(wrist + 0.015)), hold=1.0)
    turned, wanted = turn_hands_clear(BODY, root, R, R, targets, around(targets))
    palm, _ = reach(BODY, root, turned, "left_arm", targets.palms[..., 0, :])
    after = forward_kinematics(BODY, root, palm)
    assert float((after[..., WRISTS[0], :] - joints[..., WRISTS[0], :]).norm(dim=-1).min()) > 0.03
    torch.testing.assert_close(after[..., 22, :], joints[..., 22, :], atol=1e-3, rtol=0)
    torch.testing.assert_close(wanted.R_world_wrist[:, :, 0], turned[:, :, WRISTS[0]])
    torch.testing.assert_close(turned[:, :, WRISTS[1]], R[:, :, WRISTS[1]])


def test_a_foot_steps_out_of_the_way_of_what_comes():
    pose = standing()
    joints = forward_kinematics(BODY, *pose)[0]
    ankles = joints[:, ANKLES].double().numpy()
    come = np.linspace(0.9, 0.22, FRAMES)[:, None] * [1.0, 0.0, 0.0]
    targets = wish_of(pose, block((-0.1, -0.1, 0.0), (0.1, 0.3, 0.3)), T=at(come))
    turned = pose[1][0][:, [(a, a + 3) for a in ANKLES]].double().numpy()
    none = np.zeros((FRAMES, 2), bool)
    plan = FootPlan(ankles, turned, ~none, none)
    (found,) = move_feet_clear(BODY, *pose, [plan], around(targets))
    assert found.standing[:, 0].mean() > 0.6
    for start, stop in runs(found.standing[:, 0]):
        np.testing.assert_allclose(np.diff(found.ankles[start:stop, 0], axis=0), 0, atol=1e-9)
    assert np.abs(np.diff(found.ankles, axis=0)).max() < 0.06
    assert (found.ankles[..., 2] > ankles[..., 2] - 1e-6).all()
    assert np.linalg.norm(found.ankles[-1, 0] - ankles[-1, 0]) > 0.03
    R = pose[1]
    for side, leg in enumerate(("left_leg", "right_leg")):
        R, _ = reach(BODY, pose[0], R, leg, torch.from_numpy(found.ankles[None, :, side]).float())
    assert deepest((pose[0], R), targets) < 0.3 * deepest(pose, targets)


def test_who_is_clear_is_left_alone():
    pose = standing()
    targets = wish_of(pose, block((3.0, 3.0, 0.0), (3.5, 3.5, 0.5)), hold=1.0)
    there = around(targets)
    assert move_root_clear(BODY, *pose, targets, there) is pose[0]
    torch.testing.assert_close(swing_limbs_clear(BODY, *pose, there), pose[1], atol=0, rtol=0)
    turned, wanted = turn_hands_clear(BODY, pose[0], pose[1], pose[1], targets, there)
    torch.testing.assert_close(turned, pose[1], atol=0, rtol=0)
    torch.testing.assert_close(wanted.R_world_wrist, targets.R_world_wrist, atol=0, rtol=0)


def test_frames_that_are_decided_stay():
    pose = standing()
    targets = wish_of(pose, block((0.0, -0.6, 0.0), (0.8, 0.6, 0.75)))
    free = (torch.arange(FRAMES) >= 30).float()
    moved = move_root_clear(BODY, *pose, targets, around(targets, free))
    torch.testing.assert_close(moved[:, :30], pose[0][:, :30], atol=0, rtol=0)
    assert float((moved[:, 45:] - pose[0][:, 45:]).norm(dim=-1).min()) > 0.1
