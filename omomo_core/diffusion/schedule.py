"""The cosine noise schedule (Nichol and Dhariwal 2021, eq. 17), 1,000 levels as in the paper."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float
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
