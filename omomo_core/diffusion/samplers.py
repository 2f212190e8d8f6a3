"""The noise schedule, and the samplers that turn noise into motion.

The cosine noise schedule (Nichol and Dhariwal 2021, eq. 17), 1,000 levels as in the paper.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import torch
from jaxtyping import Float, Int
from torch import Tensor

LEVELS = 1000


@dataclass(frozen=True)
class Schedule:
    """q(x_n | x_0) = N(sqrt(alpha_bar_n) x_0, (1 - alpha_bar_n) I) for n = 0 .. levels - 1."""

    beta: Float[Tensor, " levels"]
    alpha_bar: Float[Tensor, " levels"]

    def add_noise(
        self, x0: Float[Tensor, " b *rest"], n: Tensor, noise: Float[Tensor, " b *rest"]
    ) -> Float[Tensor, " b *rest"]:
        """x_n for each sample's own level n, shape (b,)."""
        shape = (-1, *[1] * (x0.ndim - 1))
        signal = self.alpha_bar[n].to(x0.dtype).view(shape)
        return signal.sqrt() * x0 + (1 - signal).sqrt() * noise


def cosine_schedule(levels: int = LEVELS, offset: float = 0.008) -> Schedule:
    """The published schedule; betas are capped at 0.999 to keep the last step finite."""
    t = torch.linspace(0, levels, levels + 1, dtype=torch.float64) / levels
    signal = torch.cos((t + offset) / (1 + offset) * math.pi / 2) ** 2
    beta = (1 - signal[1:] / signal[:-1]).clamp(0, 0.999)
    return Schedule(beta=beta, alpha_bar=torch.cumprod(1 - beta, dim=0))


def shifted(u: Float[Tensor, "*b"], shift: float) -> Float[Tensor, "*b"]:
    """Move shares of the way to full noise (0 to 1) towards 1 (Esser et al. 2024, section 5.3.2)."""
    return shift * u / (1 + (shift - 1) * u)


GOLDEN = (5**0.5 - 1) / 2


def golden_sequence(number: Int[Tensor, "*b"]) -> Float[Tensor, "*b"]:
    """Return the terms of the additive golden-ratio sequence in [0, 1) with these indices."""
    return (GOLDEN * (number + 0.5)) % 1.0


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
