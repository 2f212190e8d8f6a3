"""Hands that hold nothing are led out of the person's own thighs, and no other hands are moved."""

import numpy as np
import pytest
import torch

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.limbs import reach
from omomo_core.body.model import load_body
from omomo_core.generation.solving.free_hands import lead_hands_out
from omomo_core.generation.solving.solving_config import FREE_HANDS
from omomo_core.skeleton import joint

FRAMES = 40
BODY = load_body()


@pytest.fixture(scope="module")
def hanging() -> tuple[torch.Tensor, torch.Tensor]:
    """Root and rotations of somebody whose left palm goes through the middle of the left thigh."""
    root = torch.tensor([0.0, 0.0, 1.0]).expand(1, FRAMES, 3)
    upright = torch.tensor([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # x to the left, y up, z ahead
    rotations = upright.expand(1, FRAMES, 22, 3, 3).contiguous()
    joints = forward_kinematics(BODY, root, rotations)
    hip, knee = (joints[..., joint(name), :] for name in ("left_hip", "left_knee"))
    middle = torch.lerp(hip, knee, 0.3)
    ahead = torch.linspace(-0.2, 0.2, FRAMES)[None, :, None] * upright[:, 2]
    rotations, _ = reach(BODY, root, rotations, "left_arm", middle + ahead)
    return root, rotations


def _to_thigh(root: torch.Tensor, rotations: torch.Tensor) -> np.ndarray:
    """Distance of the left palm from the thigh's bone in each frame, metres."""
    joints = forward_kinematics(BODY, root, rotations)[0]
    hip, knee = joints[:, joint("left_hip")], joints[:, joint("left_knee")]
    way = (knee - hip) / (knee - hip).norm(dim=-1, keepdim=True)
    return torch.linalg.cross(joints[:, 22] - hip, way).norm(dim=-1).numpy()


def test_a_free_hand_goes_round_the_thigh_steadily(hanging):
    root, rotations = hanging
    assert _to_thigh(root, rotations).min() < 0.04
    out = lead_hands_out(BODY, root, rotations, torch.zeros(1, FRAMES, 2), torch.ones(FRAMES))
    assert _to_thigh(root, out).min() > 0.9 * FREE_HANDS.thigh
    palms = forward_kinematics(BODY, root, out)[0, :, 22]
    assert np.linalg.norm(np.diff(palms.numpy(), 2, axis=0), axis=1).max() < 0.01  # m/frame^2
    others = [k for k in range(22) if k not in (joint("left_shoulder"), joint("left_elbow"))]
    assert torch.equal(out[:, :, others], rotations[:, :, others])


@pytest.mark.parametrize(("hold", "free"), [(1.0, 1.0), (0.0, 0.0)])
def test_a_hand_that_holds_and_a_frame_that_is_fixed_stay(hanging, hold, free):
    root, rotations = hanging
    holds = torch.full((1, FRAMES, 2), hold)
    out = lead_hands_out(BODY, root, rotations, holds, torch.full((FRAMES,), free))
    torch.testing.assert_close(out, rotations, rtol=0, atol=1e-6)


def test_hands_that_are_clear_are_not_touched(hanging):
    root, rotations = hanging
    upright = rotations.clone()
    upright[:, :, joint("left_shoulder")] = upright[:, :, joint("left_elbow")] = rotations[0, 0, 0]
    none = torch.zeros(1, FRAMES, 2)
    assert torch.equal(lead_hands_out(BODY, root, upright, none, torch.ones(FRAMES)), upright)
