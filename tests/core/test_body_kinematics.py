import pytest
import roma
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body.kinematics import forward_kinematics, full_kinematics, global_rotations
from omomo_core.body.model import load_body
from omomo_core.skeleton import ALL_PARENTS, PALM_JOINTS, joint

BODY = load_body()
seeds = st.integers(0, 2**31)


def random_pose(seed: int, *batch: int) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    gen = torch.Generator().manual_seed(seed)
    turns = torch.randn(*batch, 52, 3, generator=gen, dtype=torch.float64)
    R = roma.rotvec_to_rotmat(turns)
    root = torch.randn(*batch, 3, generator=gen, dtype=torch.float64)
    return root, R[..., :22, :, :], R[..., 22:, :, :]


@settings(max_examples=25)
@given(seeds)
def test_bones_keep_their_length(seed: int):
    root, R, fingers = random_pose(seed, 3)
    joints, _ = full_kinematics(BODY, root, R, fingers)
    above = list(ALL_PARENTS[1:])
    bones = (joints[:, 1:] - joints[:, above]).norm(dim=-1)
    rest = (BODY.rest_joints[1:] - BODY.rest_joints[above]).norm(dim=-1).double()
    torch.testing.assert_close(bones, rest.expand_as(bones))
    torch.testing.assert_close(joints[:, 0], root)


@settings(max_examples=25)
@given(seeds)
def test_a_moved_person_is_the_same_person_moved(seed: int):
    root, R, _ = random_pose(seed, 4)
    shift, turn, _ = random_pose(seed + 1, 1)
    turn = turn[:, 0]
    moved = forward_kinematics(BODY, root @ turn[0].T + shift, turn[:, None] @ R)
    expected = forward_kinematics(BODY, root, R) @ turn[0].T + shift
    torch.testing.assert_close(moved, expected)


def test_full_and_model_kinematics_agree_for_any_batch_shape():
    root, R, fingers = random_pose(0, 2, 5)
    joints, R_global = full_kinematics(BODY, root, R, fingers)
    kept = [*range(22), *PALM_JOINTS]
    torch.testing.assert_close(joints[..., kept, :], forward_kinematics(BODY, root, R))
    torch.testing.assert_close(R_global[..., :22, :, :], R)
    one = full_kinematics(BODY, root[1, 2], R[1, 2], fingers[1, 2])[0]
    torch.testing.assert_close(one, joints[1, 2])


def test_finger_rotations_are_relative_to_their_parents():
    root, R, fingers = random_pose(0)
    _, R_global = full_kinematics(BODY, root, R, fingers)
    for j in range(22, 52):
        torch.testing.assert_close(R_global[j], R_global[ALL_PARENTS[j]] @ fingers[j - 22])


def test_identity_is_the_rest_pose():
    eye = torch.eye(3).expand(22, 3, 3)
    joints = forward_kinematics(BODY, BODY.rest_joints[0], eye)
    torch.testing.assert_close(joints, BODY.rest_joints[[*range(22), *PALM_JOINTS]])


def test_a_joint_turns_its_children_only():
    root, local, _ = random_pose(3)
    before = forward_kinematics(BODY, root, global_rotations(local))
    local[joint("left_elbow")] = torch.eye(3).to(local)
    after = forward_kinematics(BODY, root, global_rotations(local))
    moved = (before - after).norm(dim=-1) > 1e-9
    assert [j for j in range(24) if moved[j]] == [joint("left_wrist"), 22]


def test_gradients_flow_to_root_and_rotations():
    root, R, _ = random_pose(1, 2)
    root.requires_grad_()
    R.requires_grad_()
    assert torch.autograd.gradcheck(lambda r, q: forward_kinematics(BODY, r, q), (root, R))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_precision_follows_the_input(dtype: torch.dtype):
    root, R, _ = random_pose(1, 2)
    assert forward_kinematics(BODY, root.to(dtype), R.to(dtype)).dtype == dtype
