"""Polished motions: hands and feet exact, flesh outside the prop, weight over the feet."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of, sole_points
from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel, load_body
from omomo_core.body.trajectory_optimization.obstacle import BoxObstacle
from omomo_core.body.trajectory_optimization.residuals import (
    VALUES,
    SolverTargets,
    anatomy_points,
    build_anatomy,
    centre_of_mass,
    limit_arm_speed,
)
from omomo_core.body.trajectory_optimization.solver import (
    Spline,
    blend_approach,
    gauss_newton_step,
    keep_approach,
    optimise_trajectory,
)
from omomo_core.learning.synthesis.attempt import targets_of
from omomo_core.learning.synthesis.palms_on_prop import Hands
from omomo_core.learning.synthesis.shapes import SolidPart, box
from omomo_core.skeleton import joint

FRAMES = 60
Z_UP = Rotation.from_euler("xz", [90, 90], degrees=True).as_matrix()
"""From the rest pose (y up, facing z) to standing in the world, facing x."""
FORWARD = Rotation.from_euler("y", -90, degrees=True).as_matrix()
"""A left hand whose fingers point ahead; the right one is its inverse."""


@pytest.fixture(scope="module")
def body() -> BodyModel:
    return load_body()


def standing(body: BodyModel) -> tuple[np.ndarray, np.ndarray]:
    """Somebody who stands still with bent knees and hanging arms."""
    rotations = np.tile(Z_UP, (FRAMES, 22, 1, 1))
    root = np.tile(
        [0.0, 0.0, float(body.rest_joints[0, 1] - body.vertices[:, 1].min())], (FRAMES, 1)
    )
    ankles = joints_of(body, root, rotations)[:, [joint("left_ankle"), joint("right_ankle")]]
    root[:, 2] -= 0.03
    turned = torch.as_tensor(rotations)
    for h, side in enumerate(("left", "right")):
        leg, arm = ("left_leg", "left_arm") if h == 0 else ("right_leg", "right_arm")
        turned, _ = reach(body, torch.as_tensor(root), turned, leg, torch.as_tensor(ankles[:, h]))
        shoulder = joints_of(body, root, turned.numpy())[:, joint(f"{side}_shoulder")]
        goal = torch.as_tensor(shoulder + np.array([0.1, 0.05 * (1 - 2 * h), -0.5]))
        pole = torch.tensor([-1.0, 0.0, 0.0]).double().expand(FRAMES, 3)
        turned, _ = reach(body, torch.as_tensor(root), turned, arm, goal, pole)
        turned[:, joint(f"{side}_wrist")] = turned[:, joint(f"{side}_elbow")]
    return root, turned.numpy()


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> SolidPart:
    return box(low, high)


def goals(
    body: BodyModel,
    base: tuple[np.ndarray, np.ndarray],
    palms: np.ndarray | None,
    part: SolidPart,
    load: float,
) -> SolverTargets:
    held = 0.0 if palms is None else 1.0
    both = np.tile(np.zeros(3) if palms is None else palms, (FRAMES, 1, 1))
    hands = Hands(
        palms=both if palms is not None else np.zeros((FRAMES, 2, 3)),
        R_world_wrist=np.stack([Z_UP @ FORWARD, Z_UP @ FORWARD.T], axis=0)[None].repeat(FRAMES, 0),
        outward=np.zeros((FRAMES, 2, 3)),
        pull=np.full((FRAMES, 2), held),
        contact=np.full((FRAMES, 2), held),
    )
    return targets_of(body, base, hands, np.tile(np.eye(4), (FRAMES, 1, 1)), [part], load=load)


FAR = block((5.0, 5.0, 0.0), (5.5, 5.5, 0.5))


def depth(body: BodyModel, root: np.ndarray, rotations: np.ndarray, part: SolidPart) -> float:
    flesh = build_anatomy(body)
    points, _ = anatomy_points(
        flesh, torch.as_tensor(root).float(), torch.as_tensor(rotations).float()
    )
    low, high = (torch.as_tensor(x)[None].float() for x in (part.low, part.high))
    return float(BoxObstacle(low, high).depth(points[:, 5:], flesh.radii)[0].max())


def test_a_good_motion_stays(body: BodyModel) -> None:
    base = standing(body)
    root, rotations = optimise_trajectory(body, *base, goals(body, base, None, FAR, 0.0))
    assert np.abs(root - base[0]).max() < 0.005
    turns = Rotation.from_matrix((np.swapaxes(base[1], -1, -2) @ rotations).reshape(-1, 3, 3))
    assert np.degrees(turns.magnitude()).max() < 3.0
    square = rotations @ np.swapaxes(rotations, -1, -2)
    np.testing.assert_allclose(square, np.tile(np.eye(3), (FRAMES, 22, 1, 1)), atol=1e-6)


def test_far_palms_are_reached_and_feet_stay(body: BodyModel) -> None:
    base = standing(body)
    palms = np.array([[0.75, 0.2, 0.95], [0.75, -0.2, 0.95]])
    wanted = goals(body, base, palms, FAR, 0.0)
    before = joints_of(body, *base)
    root, rotations = optimise_trajectory(body, *base, wanted)
    joints = joints_of(body, root, rotations)
    assert np.linalg.norm(joints[:, 22:] - palms, axis=-1).max() < 0.002
    ankles = [joint("left_ankle"), joint("right_ankle")]
    assert np.linalg.norm(joints[:, ankles] - before[:, ankles], axis=-1).max() < 1e-3
    assert np.abs(sole_points(body, root, rotations) - wanted.soles).max() < 2e-3


@pytest.mark.parametrize("turn", [0.0, 40.0, 70.0])
def test_arms_hang_as_they_did_until_shortly_before_they_hold(body: BodyModel, turn: float) -> None:
    root, rotations = standing(body)
    places = np.array([[0.45, 0.25, 1.0], [0.45, -0.25, 1.0]])
    wanted = goals(body, (root, rotations), places, FAR, 0.0)
    wanted.hold[:] = np.linspace(-2.5, 2.5, FRAMES).clip(0.0, 1.0)[:, None]
    arms = torch.as_tensor(rotations)
    for side, arm in enumerate(("left_arm", "right_arm")):
        about = Rotation.from_euler("x", turn * (1 - 2 * side), degrees=True).as_matrix()
        wanted.R_world_wrist[:, side] = about @ wanted.R_world_wrist[:, side]
        pull = torch.as_tensor(wanted.hold[:, side]).contiguous()
        goal = torch.as_tensor(wanted.palms[:, side])
        arms, _ = reach(body, torch.as_tensor(root), arms, arm, goal, weight=pull)
    wanted = keep_approach(body, root, arms.numpy(), wanted)
    palms = joints_of(body, *optimise_trajectory(body, root, arms.numpy(), wanted))[:, 22:]
    held, free = slice(FRAMES * 3 // 4, None), slice(FRAMES // 3)
    assert np.linalg.norm(palms[held] - places, axis=-1).max() < 0.005
    before = joints_of(body, root, rotations)[free, 22:]
    assert np.linalg.norm(palms[free] - before, axis=-1).max() < 0.06


def test_hands_come_smoothly_to_what_the_initial_motion_does_not_reach(body: BodyModel) -> None:
    root, rotations = standing(body)
    places = np.array([[0.85, 0.2, 1.0], [0.85, -0.2, 1.0]])
    wanted = goals(body, (root, rotations), places, FAR, 0.0)
    wanted.hold[:] = np.linspace(-2.5, 2.5, FRAMES).clip(0.0, 1.0)[:, None]
    before = joints_of(body, root, rotations)[:, 22:]
    kept, blended = (
        change(body, root, rotations, wanted) for change in (keep_approach, blend_approach)
    )
    for targets in (kept, blended):
        still = wanted.hold[:, 0] == 0
        np.testing.assert_array_equal(targets.palms[still], before[still])
        np.testing.assert_allclose(targets.palms[-1], places, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(targets.hold[still], 0.0)
        np.testing.assert_array_equal(targets.hold[-1], 1.0)
    way = np.linalg.norm(before[0] - places, axis=-1).max()
    jump, step = (np.linalg.norm(np.diff(t.palms, axis=0), axis=-1).max() for t in (kept, blended))
    assert jump == pytest.approx(way)
    assert step < way / 10


def test_clips_side_by_side_are_each_alone(body: BodyModel) -> None:
    base = standing(body)
    part = block((0.1, -0.18, 0.8), (0.6, 0.18, 1.1))
    places = [[[0.35, 0.22, 0.95], [0.35, -0.22, 0.95]], [[0.7, 0.2, 0.9], [0.7, -0.25, 1.0]]]
    alone = [goals(body, base, np.array(palms), part, 0.0) for palms in places]
    both = replace(
        alone[0],
        **{
            name: np.stack([getattr(a, name) for a in alone])
            for name in ("palms", "R_world_wrist", "hold", "ankles", "soles", "planted", "centre")
        },
    )
    root, rotations = optimise_trajectory(body, *(np.stack([x, x]) for x in base), both)
    for k, wanted in enumerate(alone):
        expected = optimise_trajectory(body, *base, wanted)
        np.testing.assert_allclose(root[k], expected[0], atol=1e-4)
        np.testing.assert_allclose(rotations[k], expected[1], atol=1e-3)
        some = both.select(slice(k, k + 1))
        np.testing.assert_array_equal(some.palms[0], wanted.palms)
        np.testing.assert_array_equal(some.balance, wanted.balance)


@pytest.mark.parametrize("corner", [0.05, 0.08])
def test_flesh_leaves_the_prop(body: BodyModel, corner: float) -> None:
    base = standing(body)
    part = block((corner, -0.18, 0.8), (0.6, 0.18, 1.1))
    wanted = goals(body, base, np.array([[0.35, 0.22, 0.95], [0.35, -0.22, 0.95]]), part, 0.0)
    first = depth(body, *base, part)
    root, rotations = optimise_trajectory(body, *base, wanted)
    assert first > 0.03
    assert depth(body, root, rotations, part) < 0.35 * first
    assert (
        np.linalg.norm(joints_of(body, root, rotations)[:, 22:] - wanted.palms, axis=-1).max()
        < 0.005
    )


def test_a_load_is_balanced_by_leaning_back(body: BodyModel) -> None:
    base = standing(body)
    part = block((0.6, -0.2, 0.95), (1.0, 0.2, 1.2))
    palms = np.array([[0.45, 0.22, 1.05], [0.45, -0.22, 1.05]])
    light, heavy = (goals(body, base, palms, part, load) for load in (0.0, 30.0))
    centres = [
        centre_of_mass(joints_of(body, *optimise_trajectory(body, *base, w)))[:, 0]
        for w in (light, heavy)
    ]
    assert (centres[0] - centres[1]).min() > 0.02
    pushed = replace(heavy, balance=np.zeros(FRAMES))
    free = centre_of_mass(joints_of(body, *optimise_trajectory(body, *base, pushed)))[:, 0]
    np.testing.assert_allclose(free, centres[0], atol=0.005)


def test_wrung_wrists_are_eased(body: BodyModel) -> None:
    base = standing(body)
    palms = joints_of(body, *base)[0, 22:]
    wanted = goals(body, base, palms + np.array([0.15, 0.0, 0.1]), FAR, 0.0)
    back = Rotation.from_rotvec([0.0, -1.3, 0.0]).as_matrix()
    wrung = replace(wanted, R_world_wrist=back @ wanted.R_world_wrist)
    guess = base[1].copy()
    guess[:, 20:22] = wrung.R_world_wrist
    _, unpolished = optimise_trajectory(body, base[0], guess, wrung, steps=0)
    _, rotations = optimise_trajectory(body, base[0], guess, wrung)

    def bend(R: np.ndarray) -> float:
        local = np.swapaxes(R[:, 18:20], -1, -2) @ R[:, 20:22]
        return float(Rotation.from_matrix(local.reshape(-1, 3, 3)).magnitude().max())

    assert bend(rotations) < bend(unpolished) - 0.2


def test_a_whirling_arm_is_calmed(body: BodyModel) -> None:
    _, rotations = standing(body)
    elbow = joint("left_elbow")
    about = Rotation.from_rotvec(np.linspace([0, 0, 0], [0, 0, 1.8], 3)).as_matrix()
    rotations[30:33, elbow] = about @ rotations[30:33, elbow]
    rotations[33:, elbow] = about[-1] @ rotations[33:, elbow]
    out = limit_arm_speed(rotations)
    turns = np.swapaxes(out[:-1, elbow], -1, -2) @ out[1:, elbow]
    assert Rotation.from_matrix(turns).magnitude().max() * 30 < 14.0
    np.testing.assert_allclose(out[[0, -1]], rotations[[0, -1]], atol=1e-6)


@settings(max_examples=15)
@given(frames=st.integers(5, 40), spacing=st.floats(2.0, 9.0), seed=st.integers(0, 99))
def test_banded_step_is_the_dense_least_squares(frames: int, spacing: float, seed: int) -> None:
    rng, n = np.random.default_rng(seed), 3
    spline = Spline(frames, spacing)
    basis = spline.basis(np.arange(frames, dtype=float))
    np.testing.assert_allclose(basis.sum(dim=1), 1.0, atol=1e-5)
    J = torch.as_tensor(rng.normal(size=(frames, 5, n)), dtype=torch.float32)
    gradient = torch.as_tensor(rng.normal(size=(frames, n)), dtype=torch.float32)
    now = torch.as_tensor(rng.normal(size=(spline.count, n)), dtype=torch.float32)
    hessian, half = J.mT @ J + torch.eye(n), torch.tensor(rng.normal(size=(n, n))).float()
    stiffness = torch.eye(n) + half @ half.T
    bending = spline.bending() + 1e-2 * torch.eye(spline.count)
    bending = torch.triu(torch.tril(bending, 3), -3)
    step = gauss_newton_step(basis, hessian, gradient, bending, stiffness, now)
    dense = torch.einsum("fi,fj,fab->iajb", basis, basis, hessian).double()
    dense += torch.einsum("ij,ab->iajb", bending, stiffness)
    slope = (basis.T @ gradient + bending @ now @ stiffness).double()
    size = spline.count * n
    expected = torch.linalg.solve(dense.reshape(size, size), -slope.reshape(size))
    np.testing.assert_allclose(step.flatten(), expected, atol=2e-3 * float(expected.abs().max()))


def test_levers_predict_how_points_move(body: BodyModel) -> None:
    flesh = build_anatomy(body)
    root, rotations = (torch.as_tensor(x[:1]).float() for x in standing(body))
    points, bones = anatomy_points(flesh, root, rotations)
    levers = (flesh.levers.flatten(0, 1) @ bones).unflatten(1, flesh.levers.shape[:2])
    turn = torch.as_tensor(
        np.random.default_rng(1).normal(size=((VALUES - 3) // 3, 3)) * 1e-2
    ).float()
    predicted = points + torch.linalg.cross(turn.expand_as(levers), levers, dim=-1).sum(dim=2)
    R = Rotation.from_rotvec((flesh.mixing @ turn).double().numpy()).as_matrix()
    moved, _ = anatomy_points(flesh, root, torch.as_tensor(R).float() @ rotations)
    np.testing.assert_allclose(moved, predicted, atol=6e-4)
    assert float((moved - points).norm(dim=-1).max()) > 0.005


@pytest.mark.parametrize("higher", [0.0, 0.1])
def test_flesh_fills_the_head_wherever_its_joint_is(body: BodyModel, higher: float):
    # Some skeletons have the joint at the nape, others between the ears; the skin is where it is.
    rest = body.rest_joints.clone()
    rest[joint("head"), 1] += higher
    other = replace(body, rest_joints=rest)
    flesh = build_anatomy(other, clearance=0.0)
    pelvis = other.rest_joints[joint("pelvis")][None].float()
    balls = anatomy_points(flesh, pelvis, torch.eye(3).expand(1, 22, 3, 3))[0][0, 5:]
    main = body.skin_joints[torch.arange(len(body.vertices)), body.skin_weights.argmax(dim=1)]
    skin = body.vertices[main == joint("head")].float()
    beyond = (torch.cdist(skin, balls) - flesh.radii).amin(dim=1)
    assert float(beyond.quantile(0.9)) < 0.02
