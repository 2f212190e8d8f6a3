import math

import pytest
import roma
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body.body_config import LIMB
from omomo_core.body.kinematics import forward_kinematics, global_rotations
from omomo_core.body.limbs import LimbName, reach
from omomo_core.body.model import load_body
from omomo_core.skeleton import joint

BODY = load_body()
LIMBS: dict[LimbName, tuple[int, int, int]] = {
    "left_arm": (joint("left_shoulder"), joint("left_elbow"), 22),
    "right_arm": (joint("right_shoulder"), joint("right_elbow"), 23),
    "left_leg": (joint("left_hip"), joint("left_knee"), joint("left_ankle")),
    "right_leg": (joint("right_hip"), joint("right_knee"), joint("right_ankle")),
}
limbs = pytest.mark.parametrize("limb", LIMBS)


def random_pose(seed: int, frames: int, size: float = 0.5) -> tuple[torch.Tensor, torch.Tensor]:
    gen = torch.Generator().manual_seed(seed)
    turns = size * torch.randn(frames, 22, 3, generator=gen)
    root = torch.randn(frames, 3, generator=gen)
    return root, global_rotations(roma.rotvec_to_rotmat(turns))


def rest_pose(frames: int) -> tuple[torch.Tensor, torch.Tensor]:
    return torch.zeros(frames, 3), torch.eye(3).expand(frames, 22, 3, 3)


def reachable(seed: int, root: torch.Tensor, R: torch.Tensor, limb: LimbName) -> torch.Tensor:
    """Targets in any direction, at 20 to 99 % of the limb's length."""
    upper, middle, end = LIMBS[limb]
    rest = forward_kinematics(BODY, *rest_pose(1))[0]
    wrist = {22: 20, 23: 21}.get(end, end)
    gen = torch.Generator().manual_seed(seed)
    way = torch.nn.functional.normalize(torch.randn(len(root), 3, generator=gen), dim=-1)
    length = (rest[middle] - rest[upper]).norm() + (rest[wrist] - rest[middle]).norm()
    way = way * length * (0.2 + 0.79 * torch.rand(len(root), 1, generator=gen))
    hand = R[:, wrist] @ (rest[end] - rest[wrist])
    return forward_kinematics(BODY, root, R)[:, upper] + way + hand


def flexion(joints: torch.Tensor, limb: LimbName) -> tuple[torch.Tensor, torch.Tensor]:
    """Directions of the upper and lower bone of a leg."""
    a, b, c = LIMBS[limb]
    upper, lower = joints[:, b] - joints[:, a], joints[:, c] - joints[:, b]
    return upper, lower


@limbs
@settings(max_examples=20)
@given(seed=st.integers(0, 2**31))
def test_reachable_targets_are_hit_and_the_rest_stays(limb: LimbName, seed: int):
    root, R = random_pose(seed, 16)
    target = reachable(seed, root, R, limb)
    solved, residual = reach(BODY, root, R, limb, target)
    joints = forward_kinematics(BODY, root, solved)
    torch.testing.assert_close(joints[:, LIMBS[limb][2]], target, atol=1e-5, rtol=0)
    assert residual.max() == 0
    torch.testing.assert_close(
        solved @ solved.mT, torch.eye(3).expand_as(solved), atol=1e-5, rtol=0
    )
    changed = (solved - R).flatten(2).norm(dim=-1).amax(dim=0) > 0
    assert set(changed.nonzero()[:, 0].tolist()) <= set(LIMBS[limb][:2])


@limbs
def test_too_far_stretches_toward_the_target_and_says_how_far(limb: LimbName):
    root, R = random_pose(0, 8)
    upper, _, end = LIMBS[limb]
    start = forward_kinematics(BODY, root, R)[:, upper]
    target = start + torch.tensor([3.0, 0.0, 0.0])
    solved, residual = reach(BODY, root, R, limb, target)
    joints = forward_kinematics(BODY, root, solved)
    assert (residual > 2.0).all()
    torch.testing.assert_close((joints[:, end] - target).norm(dim=-1), residual, atol=1e-4, rtol=0)
    first, second = flexion(joints, limb)
    if limb.endswith("leg"):
        assert (torch.cosine_similarity(first, second, dim=-1) > 0.99).all()


@limbs
def test_a_limb_that_is_solved_gently_does_not_snap_where_it_becomes_straight(limb: LimbName):
    """A target goes evenly out of reach."""
    shares = torch.linspace(0.9, 1.05, 61)
    root, R = rest_pose(len(shares))
    upper, middle, end = LIMBS[limb]
    rest = forward_kinematics(BODY, root[:1], R[:1])[0]
    wrist = {22: 20, 23: 21}.get(end, end)
    length = (rest[middle] - rest[upper]).norm() + (rest[wrist] - rest[middle]).norm()
    way = shares[:, None] * length * torch.tensor([0.0, -1.0, 0.0])
    target = rest[upper] + way + rest[end] - rest[wrist]
    snaps = []
    for gently in (False, True):
        solved, residual = reach(BODY, root, R, limb, target, gently=gently)
        joints = forward_kinematics(BODY, root, solved)
        thigh, shin = joints[:, middle] - joints[:, upper], joints[:, wrist] - joints[:, middle]
        bend = torch.cosine_similarity(thigh, shin, dim=-1).clamp(max=1.0).arccos()
        snaps.append(bend.diff().abs().max())
        assert residual[shares < LIMB.easy].max() == 0
        assert residual[shares <= 1.0].max() < 0.008 * length
    assert snaps[1] < 0.6 * snaps[0]


@limbs
def test_a_target_on_the_root_of_the_limb_is_too_close_but_sane(limb: LimbName):
    root, R = random_pose(0, 4)
    start = forward_kinematics(BODY, root, R)[:, LIMBS[limb][0]]
    solved, _ = reach(BODY, root, R, limb, start)
    assert solved.isfinite().all()
    torch.testing.assert_close(
        solved @ solved.mT, torch.eye(3).expand_as(solved), atol=1e-4, rtol=0
    )


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_straight_leg_bends_its_knee_forward(side: str):
    limb: LimbName = "left_leg" if side == "left" else "right_leg"
    root, R = rest_pose(3)
    rest = forward_kinematics(BODY, root, R)
    hip, knee, ankle = LIMBS[limb]
    target = rest[:, ankle] + torch.tensor([[0, 0.05, 0], [0, 0.2, 0.1], [0.05, 0.3, -0.2]])
    solved, residual = reach(BODY, root, R, limb, target)
    joints = forward_kinematics(BODY, root, solved)
    assert residual.max() == 0
    line = (target - joints[:, hip]) / 2 + joints[:, hip]
    assert (joints[:, knee] - line)[:, 2].min() > 0.05


def test_a_hyperextended_knee_is_bent_forward_again():
    root, R = rest_pose(1)
    R = R.clone()
    R[:, joint("left_knee")] = roma.rotvec_to_rotmat(torch.tensor([-0.2, 0.0, 0.0]))
    target = forward_kinematics(BODY, root, R)[:, joint("left_ankle")]
    solved, _ = reach(BODY, root, R, "left_leg", target)
    joints = forward_kinematics(BODY, root, solved)
    upper, lower = flexion(joints, "left_leg")
    assert torch.linalg.cross(upper, lower)[0, 0] > 0  # about +x, body left
    torch.testing.assert_close(joints[:, joint("left_ankle")], target, atol=1e-5, rtol=0)


@pytest.mark.parametrize(("limb", "inward"), [("left_arm", -0.4), ("right_arm", 0.4)])
def test_straight_arms_bend_forward_from_the_t_pose(limb: LimbName, inward: float):
    root, R = rest_pose(1)
    palm = forward_kinematics(BODY, root, R)[:, LIMBS[limb][2]]
    solved, _ = reach(BODY, root, R, limb, palm + torch.tensor([inward, 0.0, 0.0]))
    joints = forward_kinematics(BODY, root, solved)
    upper, elbow, _ = LIMBS[limb]
    assert joints[0, elbow, 2] < joints[0, upper, 2] - 0.05  # the elbow points back


@limbs
def test_a_bent_limb_already_there_stays_as_it_is(limb: LimbName):
    root, R = rest_pose(1)
    end = LIMBS[limb][2]
    target = forward_kinematics(BODY, root, R)[:, end]
    bent, _ = reach(BODY, root, R, limb, target * torch.tensor([0.8, 0.8, 1.0]))
    there = forward_kinematics(BODY, root, bent)[:, end]
    again, _ = reach(BODY, root, bent, limb, there)
    torch.testing.assert_close(again, bent, atol=1e-4, rtol=0)


def test_the_pole_points_the_elbow():
    root, R = rest_pose(1)
    target = BODY.rest_joints[None, joint("left_shoulder")] - BODY.rest_joints[0]
    target = target + torch.tensor([0.0, -0.2, 0.3])
    shoulder = forward_kinematics(BODY, root, R)[:, joint("left_shoulder")]
    for pole in ([1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]):
        solved, residual = reach(BODY, root, R, "left_arm", target, pole=torch.tensor([pole]))
        joints = forward_kinematics(BODY, root, solved)
        wrist = joints[:, joint("left_wrist")]
        along = torch.nn.functional.normalize(wrist - shoulder, dim=-1)
        elbow = joints[:, joint("left_elbow")] - shoulder
        elbow = elbow - (elbow * along).sum() * along
        wanted = torch.tensor([pole]) - (torch.tensor([pole]) * along).sum() * along
        assert torch.cosine_similarity(elbow, wanted)[0] > 0.999
        assert residual.max() == 0
        torch.testing.assert_close(joints[:, 22], target, atol=1e-5, rtol=0)


def test_weight_blends_along_the_geodesic():
    root, R = random_pose(0, 1, size=0.2)
    target = forward_kinematics(BODY, root, R)[:, 22] + torch.tensor([-0.1, -0.3, 0.1])
    solved = {
        w: reach(BODY, root, R, "left_arm", target, weight=torch.tensor([w]))[0]
        for w in (0.0, 0.5, 1.0)
    }
    full, _ = reach(BODY, root, R, "left_arm", target)
    torch.testing.assert_close(solved[0.0], R)
    torch.testing.assert_close(solved[1.0], full, atol=1e-5, rtol=0)
    elbow = joint("left_elbow")
    whole = roma.rotmat_geodesic_distance(R, full)[0, elbow]
    half = roma.rotmat_geodesic_distance(R, solved[0.5])[0, elbow]
    assert math.isclose(half, whole / 2, abs_tol=1e-3)


def test_gradients_are_right_and_finite():
    root, R = random_pose(2, 2, size=0.3)
    root, R = root.double(), R.double()
    target = forward_kinematics(BODY, root, R)[:, 22] - 0.1
    weight = torch.full((2,), 0.7, dtype=torch.float64)
    inputs = [x.requires_grad_() for x in (root, R, target, weight)]

    def palms(root, R, target, weight):
        solved, _ = reach(BODY, root, R, "left_arm", target, weight=weight)
        return forward_kinematics(BODY, root, solved)[:, 20]

    assert torch.autograd.gradcheck(palms, inputs)


def test_gradients_stay_finite_in_the_t_pose_and_out_of_reach():
    root, R = rest_pose(2)
    R = R.clone().requires_grad_()
    target = torch.tensor([[5.0, 0.0, 0.0], [0.78, 0.42, 0.0]], requires_grad=True)
    weight = torch.tensor([0.0, 1.0], requires_grad=True)
    solved, residual = reach(BODY, root, R, "left_arm", target, weight=weight)
    (solved.square().sum() + solved[..., 0].sum() + residual.sum()).backward()
    for x in (R, target, weight):
        assert x.grad is not None
        assert x.grad.isfinite().all()
