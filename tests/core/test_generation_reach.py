"""The pelvis goes to where arms reach what they hold."""

import numpy as np
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import load_body
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.solving.foot_plan import plan_feet
from omomo_core.generation.solving.palm_plan import move_root_within_reach, solve_arms
from omomo_core.generation.solving.solving_config import REACH
from omomo_core.motion import ObjectMesh

BODY = load_body()
FRAMES = 60
BOX = trimesh.creation.box((0.3, 0.3, 0.3))
OBJECT_MODEL = ObjectModel(ObjectMesh(np.array(BOX.vertices), np.array(BOX.faces), "box"), 1.0)


def _standing(samples: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Arms straight out to the sides: nothing farther is within their reach."""
    root = torch.zeros(samples, FRAMES, 3)
    root[..., 2] = 0.95
    return root, torch.eye(3).expand(samples, FRAMES, 22, 3, 3).clone()


def _targets(palms: torch.Tensor, hold: torch.Tensor, R: torch.Tensor) -> InteractionTargets:
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    return InteractionTargets(
        palms, hold, R[:, :, (20, 21)], T, OBJECT_MODEL.obstacle, np.zeros(FRAMES)
    )


def _moved(off: torch.Tensor, hold: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """How far the pelvis was moved, and the palms that hold are off then, samples by frames."""
    root, R = _standing(len(off))
    palms = forward_kinematics(BODY, root, R)[..., 22:, :] + off[:, None, None]
    targets = _targets(palms, hold.expand(len(off), FRAMES, 2).contiguous(), R)
    joints = forward_kinematics(BODY, root, R).double().numpy()
    up = np.zeros((FRAMES, 4))
    feet = [plan_feet(BODY, j, R[0].double().numpy(), up, None) for j in joints]
    near = move_root_within_reach(
        BODY, root, R, feet, targets, torch.ones(FRAMES), REACH.last_stretch
    )
    made = forward_kinematics(BODY, near, solve_arms(BODY, near, R, targets))[..., 22:, :]
    miss = (made - palms).norm(dim=-1) * targets.hold
    return (near - root).norm(dim=-1), miss.amax(dim=-1)


@given(far=st.floats(0.01, 0.2), angle=st.floats(-0.8, 0.8), hand=st.integers(0, 1))
@settings(max_examples=15)
def test_what_one_hand_holds_is_within_its_reach_to_some_millimetres(
    far: float, angle: float, hand: int
):
    side = (1.0, -1.0)[hand]
    off = far * torch.tensor([[side * np.cos(angle), np.sin(angle), 0.0]]).float()
    moved, miss = _moved(off, torch.eye(2)[hand])
    assert float(miss.max()) < 0.005
    assert float(moved.max()) < far + 0.01


def test_a_sample_that_is_wrong_says_so():
    moved, miss = _moved(torch.tensor([[0.6, 0.0, 0.0]]), torch.tensor([1.0, 0.0]))
    assert float(moved.max()) <= REACH.farthest + 1e-5
    assert float(miss.min()) > 0.3


def test_what_becomes_of_one_does_not_hang_on_the_others():
    near, far = torch.tensor([[0.02, 0.0, 0.0]]), torch.tensor([[0.22, 0.0, 0.0]])
    hold = torch.tensor([1.0, 0.0])
    together = _moved(torch.cat([near, far]), hold)
    for k, one in enumerate((near, far)):
        for a, b in zip(together, _moved(one, hold), strict=True):
            torch.testing.assert_close(a[k], b[0])
