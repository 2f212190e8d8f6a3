"""Foot plans: the toes of a foot that is put elsewhere clear the floor as those of people do."""

import numpy as np
import pytest
import torch

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import load_body
from omomo_core.generation.solving.foot_plan import ANKLES, TOES, plan_feet
from omomo_core.generation.solving.solving_config import FOOT_PLAN

BODY = load_body()
LEFT, AIR = 0, slice(20, 32)


def dragged(length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Joints, rotations and foot contacts of somebody whose left foot slides ahead along the floor."""
    upright = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    R = np.tile(upright, (60, 22, 1, 1))
    root = BODY.rest_joints[0].double() - torch.tensor([0.0, float(BODY.vertices[:, 1].min()), 0.0])
    still = torch.from_numpy(upright) @ root
    joints = forward_kinematics(BODY, still.expand(60, 3), torch.from_numpy(R)).numpy().copy()
    way = np.interp(np.arange(60), [AIR.start - 1, AIR.stop], [0.0, length])
    for joint in (ANKLES[LEFT], TOES[LEFT]):
        joints[:, joint, 0] += way
    down = np.ones((60, 4))
    down[AIR, 0] = down[AIR, 2] = 0.0
    return joints, R, down


@pytest.mark.parametrize("length", [0.15, 0.4, 0.9])
def test_a_foot_that_skims_the_floor_is_raised_in_its_step(length: float):
    joints, rotations, down = dragged(length)
    plan = plan_feet(BODY, joints, rotations, down)
    raised = plan.ankles[:, LEFT, 2] - joints[0, ANKLES[LEFT], 2]
    least = FOOT_PLAN.least_swing + FOOT_PLAN.swing_per_metre * length
    assert raised.max() == pytest.approx(min(least, FOOT_PLAN.highest_swing), abs=2e-3)
    assert abs(raised[: AIR.start - 1]).max() < 1e-3
    assert abs(raised[AIR.stop + 1 :]).max() < 1e-3
    # It leaves the floor and comes back to it softly.
    assert np.abs(np.diff(raised, 2)).max() < 0.006
    assert abs(plan.ankles[:, 1, 2] - joints[:, ANKLES[1], 2]).max() < 1e-3


def test_a_foot_that_rises_by_itself_is_left_as_it_is():
    joints, rotations, down = dragged(0.4)
    rise = 0.09 * np.sin(np.pi * np.linspace(0, 1, 12)) ** 2
    for joint in (ANKLES[LEFT], TOES[LEFT]):
        joints[AIR, joint, 2] += rise
    plan = plan_feet(BODY, joints, rotations, down)
    assert np.allclose(plan.ankles[AIR, LEFT, 2], joints[AIR, ANKLES[LEFT], 2], atol=3e-3)
