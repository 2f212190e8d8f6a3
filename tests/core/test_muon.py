"""Muon's steps: orthogonal, and as torch's own takes them."""

import pytest
import torch

from omomo_core.learning.training.training_task import Muon, orthogonal


@pytest.mark.parametrize("shape", [(24, 24), (12, 48), (48, 12)])
def test_singular_values_come_near_one(shape: tuple[int, int]):
    torch.manual_seed(0)
    values = torch.linalg.svdvals(orthogonal(1e-3 * torch.randn(shape)))
    assert values.min() > 0.3
    assert values.max() < 1.3


def test_steps_are_those_of_torch():
    torch.manual_seed(1)
    ours = torch.nn.Parameter(torch.randn(32, 16))
    theirs = torch.nn.Parameter(ours.detach().clone())
    mine = Muon([ours], lr=0.01, weight_decay=0.1)
    other = torch.optim.Muon([theirs], lr=0.01, weight_decay=0.1, adjust_lr_fn="match_rms_adamw")
    for _ in range(10):
        ours.grad = torch.randn(32, 16)
        theirs.grad = ours.grad.clone()
        mine.step()
        other.step()
    assert torch.allclose(ours, theirs, atol=2e-3)
    assert mine.state_dict()["state"][0].keys() == other.state_dict()["state"][0].keys()
