"""Limbs that swing faster than people's are steadied, and what is held stays in its place."""

import numpy as np
import pytest
import roma
import torch

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.limbs import reach
from omomo_core.body.model import load_body
from omomo_core.generation.selection.selection_config import HUMAN_LIMITS
from omomo_core.generation.selection.speed_limits import TURNING, measure_speeds
from omomo_core.generation.solving.steady_limbs import steady_limbs

BODY = load_body()
FRAMES = 60
FREE = torch.ones(FRAMES)


def standing() -> tuple[torch.Tensor, torch.Tensor]:
    """Root and rotations of a person who stands still with bent arms."""
    root = torch.tensor([0.0, 0.0, 0.95]).expand(1, FRAMES, 3).contiguous()
    upright = roma.rotvec_to_rotmat(torch.tensor([torch.pi / 2, 0.0, 0.0]))
    rotations = upright.expand(1, FRAMES, 22, 3, 3).contiguous()
    palm = forward_kinematics(BODY, root, rotations)[:, :, 0] + torch.tensor([0.2, -0.3, 0.2])
    return root, reach(BODY, root, rotations, "left_arm", palm)[0]


def with_snapping_elbow() -> tuple[torch.Tensor, torch.Tensor]:
    """The same person, whose left elbow flips to another side in one frame; the palm stays."""
    root, rotations = standing()
    joints = forward_kinematics(BODY, root, rotations)
    axis = torch.nn.functional.normalize(joints[..., 20, :] - joints[..., 16, :], dim=-1)
    late = (torch.arange(FRAMES) >= FRAMES // 2).float()
    turn = roma.rotvec_to_rotmat(axis * late[:, None])[:, :, None]
    rotations[:, :, [16, 18]] = turn @ rotations[:, :, [16, 18]]
    return root, rotations


def fastest_upper_arm(root: torch.Tensor, rotations: torch.Tensor) -> float:
    joints = forward_kinematics(BODY, root, rotations)[0].double().numpy()
    return float(
        measure_speeds(joints, rotations[0][:, TURNING].double().numpy())["upper_arm"].max()
    )


def test_an_elbow_that_flips_comes_round_slowly_and_the_held_palm_stays():
    root, rotations = with_snapping_elbow()
    assert fastest_upper_arm(root, rotations) > HUMAN_LIMITS.upper_arm
    steady = steady_limbs(BODY, root, rotations, ["left_arm"], np.ones((1, FRAMES, 1)), FREE)
    assert fastest_upper_arm(root, steady) <= HUMAN_LIMITS.upper_arm
    before, after = (forward_kinematics(BODY, root, R) for R in (rotations, steady))
    torch.testing.assert_close(after[..., 22:, :], before[..., 22:, :], atol=1e-4, rtol=0)
    far = [0, FRAMES - 1]
    torch.testing.assert_close(steady[:, far], rotations[:, far], atol=1e-5, rtol=0)


def test_a_palm_that_is_free_takes_a_longer_way_where_it_leaps():
    root, rotations = standing()
    palm = forward_kinematics(BODY, root, rotations)[..., 22, :].clone()
    palm[:, FRAMES // 2 :] += torch.tensor([0.0, 0.0, 0.25])
    rotations, _ = reach(BODY, root, rotations, "left_arm", palm)
    free, held = (
        steady_limbs(BODY, root, rotations, ["left_arm"], np.full((1, FRAMES, 1), value), FREE)
        for value in (0.0, 1.0)
    )
    at, kept = (forward_kinematics(BODY, root, R)[..., 22, :] for R in (free, held))
    assert (at - palm).norm(dim=-1).max() > 0.01
    torch.testing.assert_close(kept, palm, atol=1e-4, rtol=0)
    assert fastest_upper_arm(root, free) < fastest_upper_arm(root, rotations)


@pytest.mark.parametrize("fixed", [False, True])
def test_limbs_that_do_not_leap_or_are_fixed_keep_every_bit(fixed: bool):
    root, rotations = with_snapping_elbow() if fixed else standing()
    limbs, held = ["left_arm", "right_arm", "left_leg", "right_leg"], np.zeros((1, FRAMES, 4))
    steady = steady_limbs(BODY, root, rotations, limbs, held, FREE * (not fixed))
    assert torch.equal(steady, rotations)
