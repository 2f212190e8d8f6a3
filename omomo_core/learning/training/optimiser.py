"""The optimiser of a network: Muon for the matrices that its task names, AdamW for everything else."""

from collections.abc import Iterable

import torch
from jaxtyping import Float
from torch import Tensor, nn

from omomo_core.learning.training.training_task import TrainingTask
from omomo_core.precision import quick_in_bf16

MUON_RATE = 4.0
"""Muon's steps against AdamW's: orthogonal ones bear to be larger."""

_ROUNDS = 5
_A, _B, _C = 3.4445, -4.7750, 2.0315
"""The published quintic: steep at zero, near one between 0.7 and 1.2."""


class Optimiser:
    """Muon and AdamW with one schedule of the learning rate.

    Muon (Jordan et al. 2024) brings our stages as far in 500 steps as AdamW in more than 1,000; the
    paper's networks keep to AdamW.
    """

    def __init__(self, task: TrainingTask, rate: float) -> None:
        blocks = list(task.muon)
        inside = {id(p) for p in blocks}
        others = [p for p in task.network.parameters() if id(p) not in inside]
        adam = torch.optim.AdamW(others, lr=rate, weight_decay=0.01, fused=True)
        self._parts: list[tuple[torch.optim.Optimizer, float]] = [(adam, rate)]
        if blocks:
            muon = Muon(blocks, lr=MUON_RATE * rate, weight_decay=0.01)
            self._parts.append((muon, MUON_RATE * rate))

    def step(self, loss: Tensor, parameters: list[nn.Parameter], share: float) -> None:
        """One step down the gradient of `loss`, at `share` of the full rate."""
        for part, rate in self._parts:
            part.zero_grad()
            for group in part.param_groups:
                group["lr"] = share * rate
        loss.backward()
        torch.nn.utils.clip_grad_norm_(parameters, 1.0)
        for part, _ in self._parts:
            part.step()

    def tensors(self) -> dict[str, Tensor]:
        """Return the state that a resumed run needs, by name."""
        return {
            f"{k}.{i}.{name}": value.contiguous()
            for k, (part, _) in enumerate(self._parts)
            for i, moments in part.state_dict()["state"].items()
            for name, value in moments.items()
        }

    def load(self, tensors: dict[str, Tensor]) -> None:
        """Restore the state that `tensors` returned."""
        for k, (part, _) in enumerate(self._parts):
            moments: dict[int, dict[str, Tensor]] = {}
            for key, value in tensors.items():
                which, index, name = key.split(".", 2)
                if int(which) == k:
                    moments.setdefault(int(index), {})[name] = value
            groups = part.state_dict()["param_groups"]
            part.load_state_dict({"state": moments, "param_groups": groups})


class Muon(torch.optim.Optimizer):
    """Muon (Jordan et al. 2024): momentum whose steps are made orthogonal, for matrices.

    torch.optim.Muon always multiplies in bfloat16, which most processors emulate; this one does so only
    where it is quick.
    """

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
