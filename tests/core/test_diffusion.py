"""Schedule, samplers and denoiser against published formulas and against a case with a known answer."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body_stage import paper as body_paper
from omomo_core.diffusion.blocks import DenoiserConfig
from omomo_core.diffusion.denoiser import Denoiser
from omomo_core.diffusion.samplers import sample
from omomo_core.diffusion.schedule import cosine_schedule
from omomo_core.hand_stage import paper as hand_paper
from omomo_core.stage import Stage

SCHEDULE = cosine_schedule()


def test_schedule_has_the_published_values():
    # The formula of Nichol and Dhariwal at a few levels, and the release's measured numbers.
    def f(t: float) -> float:
        return math.cos((t + 0.008) / 1.008 * math.pi / 2) ** 2

    for n in (0, 250, 500, 750):
        assert SCHEDULE.alpha_bar[n].item() == pytest.approx(f((n + 1) / 1000) / f(0), rel=1e-6)
    assert SCHEDULE.beta[0].item() == pytest.approx(4.1e-5, rel=0.02)
    assert SCHEDULE.beta.max().item() == pytest.approx(0.999)
    assert (SCHEDULE.alpha_bar.diff() < 0).all()


@given(level=st.integers(0, 999), seed=st.integers(0, 100))
@settings(max_examples=20, deadline=None)
def test_noise_keeps_the_variance_of_standard_data(level: int, seed: int):
    g = torch.Generator().manual_seed(seed)
    x0, noise = torch.randn(2, 1, 20_000, generator=g)
    x = SCHEDULE.add_noise(x0[None, 0], torch.tensor([level]), noise[None, 0])
    assert x.std().item() == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(("sampler", "steps"), [("ddpm", 0), ("ddim", 100), ("dpm++", 20)])
def test_samplers_draw_from_a_gaussian_whose_posterior_is_known(sampler: str, steps: int):
    """For x0 ~ N(mean, std^2), E[x0 | x_n] is linear in x_n: a perfect network. Samples must fit."""
    mean, std = 2.0, 0.5

    def perfect(x: torch.Tensor, n: int) -> torch.Tensor:
        a = SCHEDULE.alpha_bar[n]
        return mean + a.sqrt() * std**2 / (a * std**2 + 1 - a) * (x - a.sqrt() * mean)

    g = torch.Generator().manual_seed(0)
    x = torch.randn(20_000, generator=g, dtype=torch.float64)
    out = sample(perfect, x, SCHEDULE, g, sampler=sampler, steps=steps)  # type: ignore[arg-type]
    assert out.mean().item() == pytest.approx(mean, abs=0.02)
    assert out.std().item() == pytest.approx(std, rel=0.04)


def test_dpm_solver_converges_faster_than_ddim():
    def perfect(x: torch.Tensor, n: int) -> torch.Tensor:
        a = SCHEDULE.alpha_bar[n]
        return a.sqrt() * 0.25 / (a * 0.25 + 1 - a) * x

    x = torch.linspace(-2, 2, 101, dtype=torch.float64)
    g = torch.Generator()
    exact = sample(perfect, x, SCHEDULE, g, sampler="ddim", steps=1000)
    ddim = (sample(perfect, x, SCHEDULE, g, sampler="ddim", steps=20) - exact).abs().max()
    dpm = (sample(perfect, x, SCHEDULE, g, sampler="dpm++", steps=20) - exact).abs().max()
    assert dpm < 0.5 * ddim


def test_paper_networks_have_the_published_number_of_weights():
    for config, count in ((hand_paper.CONFIG, 12_504_582), (body_paper.CONFIG, 10_974_668)):
        assert sum(p.numel() for p in Stage(config).parameters()) == count


def _denoiser(mask_keys: bool) -> Denoiser:
    torch.manual_seed(0)
    config = DenoiserConfig(
        channels=3,
        condition=2,
        width=32,
        head_width=8,
        feedforward=32,
        layers=2,
        mask_keys=mask_keys,
    )
    return Denoiser(config).eval()


@pytest.mark.parametrize("mask_keys", [True, False])
def test_padding_leaks_into_valid_frames_only_where_the_paper_lets_it(mask_keys: bool):
    network = _denoiser(mask_keys)
    x, condition = torch.randn(1, 8, 3), torch.randn(1, 8, 2)
    valid = torch.arange(8)[None] < 5
    level = torch.tensor([100])
    a = network(x, condition, None, level, valid)[:, :5]
    x = torch.where(valid[..., None], x, torch.randn_like(x) * 10)
    b = network(x, condition, None, level, valid)[:, :5]
    assert torch.allclose(a, b, atol=1e-6) == mask_keys
