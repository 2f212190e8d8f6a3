"""Schedule, samplers and denoiser against published formulas and against a case with a known answer."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.diffusion.denoiser import Denoiser, DenoiserConfig
from omomo_core.diffusion.samplers import cosine_schedule, sample, shifted
from omomo_core.stages import body_paper
from omomo_core.stages import hands_paper as hand_paper
from omomo_core.stages.stage import Stage

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
@settings(max_examples=20)
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


def _filled(**sizes: object) -> Denoiser:
    """A small denoiser whose every weight follows from its place alone."""
    config = DenoiserConfig(3, 2, shape=2, shape_hidden=4, shape_width=4, width=8, **sizes)  # type: ignore[arg-type]
    net = Denoiser(config).eval()
    with torch.no_grad():
        for k, parameter in enumerate(net.parameters()):
            angle = torch.arange(parameter.numel(), dtype=torch.float32) + 10 * k
            parameter.copy_(0.5 * torch.sin(angle).reshape(parameter.shape))
    return net


@pytest.mark.parametrize(
    ("sizes", "expected"),
    [
        ({"patch": 1}, [-1.19817, 0.16713, 0.63054, -1.17234, 0.16793, 0.60447]),
        (
            {"patch": 2, "mask_keys": True, "modulated": True},
            [-1.14175, -0.2009, 1.09145, -0.99191, -0.34212, 0.9827],
        ),
    ],
)
def test_a_denoiser_computes_what_its_weights_were_trained_for(
    sizes: dict[str, object], expected: list[float]
):
    """Any change of the architecture breaks shipped weights; the numbers are this one's own."""
    small = {"layers": 2, "heads": 2, "head_width": 4, "feedforward": 6, "dropout": 0.5}
    net = _filled(**small, **sizes)
    x, condition = (
        torch.arange(36.0).sin().reshape(2, 6, 3),
        torch.arange(24.0).cos().reshape(2, 6, 2),
    )
    shape = torch.tensor([[[0.5, -1.0]], [[1.5, 0.25]]])
    valid = torch.ones(2, 6, dtype=torch.bool)
    valid[1, 4:] = False
    found = net(x, condition, shape, torch.tensor([3, 700]), valid)
    assert found[:, 1].flatten().tolist() == pytest.approx(expected, abs=1e-5)


@given(u=st.floats(0, 1), shift=st.floats(0.2, 8))
def test_the_shift_towards_noise_is_undone_by_its_inverse(u: float, shift: float):
    there = shifted(torch.tensor(u, dtype=torch.float64), shift)
    assert -1e-12 <= there <= 1 + 1e-12
    assert (there >= u) == (shift >= 1) or there.item() == pytest.approx(u)
    assert shifted(there, 1 / shift).item() == pytest.approx(u, abs=1e-9)


@pytest.mark.parametrize("sampler", ["ddpm", "ddim", "dpm++"])
def test_a_sampler_says_how_far_it_is(sampler: str):
    told: list[float] = []
    g = torch.Generator().manual_seed(0)
    schedule = cosine_schedule(10)
    sample(
        lambda x, n: x,
        torch.zeros(3),
        schedule,
        g,
        sampler=sampler,
        steps=5,
        on_step=told.append,  # type: ignore[arg-type]
    )
    assert told == sorted(told)
    assert told[-1] == 1
    assert 0 < told[0] <= 0.2
