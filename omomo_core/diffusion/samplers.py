"""Samplers for a network that predicts x0: ancestral DDPM, DDIM, and DPM-Solver++ (2M)."""

from collections.abc import Callable
from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.diffusion.schedule import Schedule, shifted

PredictX0 = Callable[[Tensor, int], Tensor]
"""(x_n, level n) -> x0, any batch shape."""
Sampler = Literal["ddpm", "ddim", "dpm++"]


def sample(
    predict: PredictX0,
    x: Float[Tensor, "*shape"],
    schedule: Schedule,
    generator: torch.Generator,
    *,
    sampler: Sampler = "dpm++",
    steps: int = 20,
    shift: float = 1.0,
    on_step: Callable[[float], None] = lambda done: None,
) -> Float[Tensor, "*shape"]:
    """Turn standard normal noise x into a sample.

    Args:
        predict: the network.
        x: noise of the wanted shape.
        schedule: the schedule the network was trained with.
        generator: source of the noise that ancestral sampling adds.
        sampler: "ddpm" always walks every level; the others take `steps`.
        steps: network evaluations of "ddim" and "dpm++".
        shift: how far those evaluations lean to much noise (see `shifted`).
        on_step: called with the fraction done after each evaluation.
    """
    if sampler == "ddpm":
        return _ddpm(predict, x, schedule, generator, on_step)
    levels = _levels(schedule, steps, shift)
    step = _ddim_step if sampler == "ddim" else _dpm_step
    previous: tuple[Tensor, int] | None = None
    for i, n in enumerate(levels):
        x0 = predict(x, n)
        if i + 1 == len(levels):
            x = x0
        else:
            x, previous = step(x, x0, n, levels[i + 1], previous, schedule), (x0, n)
        on_step((i + 1) / len(levels))
    return x


def _levels(schedule: Schedule, steps: int, shift: float) -> list[int]:
    last = len(schedule.beta) - 1
    levels = [round(last * n) for n in shifted(torch.linspace(1, 0, steps), shift).tolist()]
    return sorted(set(levels), reverse=True)


def _ddpm(
    predict: PredictX0,
    x: Tensor,
    schedule: Schedule,
    generator: torch.Generator,
    on_step: Callable[[float], None],
) -> Tensor:
    """Ho et al. 2020, eq. 6-7: x_{n-1} ~ q(x_{n-1} | x_n, x0)."""
    levels = len(schedule.beta)
    for n in reversed(range(levels)):
        x0 = predict(x, n)
        if n == 0:
            on_step(1.0)
            return x0
        beta, now, before = schedule.beta[n], schedule.alpha_bar[n], schedule.alpha_bar[n - 1]
        mean = (before.sqrt() * beta * x0 + (1 - beta).sqrt() * (1 - before) * x) / (1 - now)
        spread = (beta * (1 - before) / (1 - now)).sqrt()
        noise = torch.randn(x.shape, generator=generator, dtype=x.dtype)
        x = (mean + spread * noise).to(x.dtype)
        on_step(1 - n / levels)
    return x


def _ddim_step(
    x: Tensor, x0: Tensor, n: int, m: int, previous: tuple[Tensor, int] | None, schedule: Schedule
) -> Tensor:
    """Song et al. 2021, eq. 12 with eta = 0."""
    now, then = schedule.alpha_bar[n], schedule.alpha_bar[m]
    noise = (x - now.sqrt() * x0) / (1 - now).sqrt()
    return (then.sqrt() * x0 + (1 - then).sqrt() * noise).to(x.dtype)


def _dpm_step(
    x: Tensor, x0: Tensor, n: int, m: int, previous: tuple[Tensor, int] | None, schedule: Schedule
) -> Tensor:
    """Lu et al. 2022, algorithm 2 (multistep, second order, data prediction)."""

    def half_log_snr(level: int) -> Tensor:
        a = schedule.alpha_bar[level]
        return 0.5 * (a / (1 - a)).log()

    h = half_log_snr(m) - half_log_snr(n)
    estimate = x0
    # Into the last level the step in log SNR is many times the one before it: extrapolating there
    # overshoots (Lu et al. 2022, section 5 ends at first order too).
    if previous is not None and m > 0:
        ratio = (half_log_snr(n) - half_log_snr(previous[1])) / h
        estimate = x0 + (x0 - previous[0]) / (2 * ratio)
    now, then = schedule.alpha_bar[n], schedule.alpha_bar[m]
    keep = (1 - then).sqrt() / (1 - now).sqrt()
    return (keep * x - then.sqrt() * torch.expm1(-h) * estimate).to(x.dtype)
