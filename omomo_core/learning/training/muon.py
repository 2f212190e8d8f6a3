"""Muon (Jordan et al. 2024): momentum whose steps are made orthogonal, for matrices."""

from collections.abc import Iterable

import torch
from jaxtyping import Float
from torch import Tensor, nn

from omomo_core.precision import quick_in_bf16

_ROUNDS = 5
_A, _B, _C = 3.4445, -4.7750, 2.0315
"""The published quintic: steep at zero, near one between 0.7 and 1.2."""


class Muon(torch.optim.Optimizer):
    """As torch's own, whose products are always in bfloat16: most processors emulate that."""

    def __init__(
        self,
        parameters: Iterable[nn.Parameter],
        lr: float,
        weight_decay: float,
        momentum: float = 0.95,
    ) -> None:
        """`lr` means as much as AdamW's: steps are as large as its (Liu et al. 2025)."""
        super().__init__(parameters, {"lr": lr, "weight_decay": weight_decay, "momentum": momentum})

    @torch.no_grad()
    def step(self, closure: None = None) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        """One step down the gradients that there are."""
        for group in self.param_groups:
            for p in group["params"]:
                if p.grad is None:
                    continue
                if "momentum_buffer" not in self.state[p]:
                    self.state[p]["momentum_buffer"] = torch.zeros_like(p)
                buffer = self.state[p]["momentum_buffer"]
                buffer.lerp_(p.grad, 1 - group["momentum"])
                update = orthogonal(p.grad.lerp(buffer, group["momentum"]))
                size = 0.2 * max(p.shape) ** 0.5
                p.mul_(1 - group["lr"] * group["weight_decay"])
                p.add_(update, alpha=-group["lr"] * size)


def orthogonal(matrix: Float[Tensor, "rows columns"]) -> Float[Tensor, "rows columns"]:
    """The matrix with singular values near one, by Newton and Schulz' iteration."""
    x = matrix.bfloat16() if quick_in_bf16(matrix.device) else matrix.float()
    wide = x if x.shape[0] <= x.shape[1] else x.T
    wide = wide / wide.norm().clamp(min=1e-7)
    for _ in range(_ROUNDS):
        gram = wide @ wide.T
        wide = torch.addmm(wide, torch.addmm(gram, gram, gram, beta=_B, alpha=_C), wide, beta=_A)
    return (wide if x.shape[0] <= x.shape[1] else wide.T).to(matrix)
