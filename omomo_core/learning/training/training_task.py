"""What the training loop asks of a network, and the optimiser that suits it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

import torch
from jaxtyping import Float
from torch import Tensor, nn

from omomo_core.compute import quick_in_bf16
from omomo_core.learning.training.corpus import Corpus

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


@dataclass(frozen=True)
class TrainOptions:
    """Steps, batch, learning rate and weights of the losses."""

    steps: int
    batch: int = 64
    rate: float = 1e-3
    warmup: int = 200
    ema: float = 0.999
    velocity: float = 1.0
    """Weight of the L1 loss on frame-to-frame differences (capture configuration)."""
    feet: float = 20.0
    """Weight of the L1 error of the feet's steps in the world, metres a frame (capture body stage):
    root and feet err little each, and together they glide."""
    root: float = 0.5
    """Weight of the L1 error of the root (capture body stage): three of 208 features, and the whole
    body stands where they say."""
    seed: int = 0


Mean = Callable[[Tensor], Tensor]
"""The mean of a count over the processes that train together."""


@runtime_checkable
class TrainingTask(Protocol):
    """A network with its training examples and its loss."""

    @property
    def name(self) -> str:
        """The name of the network's file."""
        ...

    @property
    def network(self) -> nn.Module:
        """Changed by training."""
        ...

    @property
    def config(self) -> "DataclassInstance":
        """What an untrained network is built from."""
        ...

    @property
    def muon(self) -> Sequence[nn.Parameter]:
        """Parameters that Muon moves; AdamW moves the others."""
        ...

    def measure(self, corpus: Corpus, batch: int) -> None:
        """Set the statistics of the network from the data."""
        ...

    def draw(self, corpus: Corpus, count: int) -> Any:
        """A dataclass of tensors (count, ...) or None: random windows, and all the noise they need."""
        ...

    def loss(
        self, forward: nn.Module, example: Any, options: TrainOptions, mean: Mean
    ) -> Float[Tensor, ""]:
        """Loss of an example that lies on the network's device.

        Args:
            forward: the network, perhaps wrapped so that gradients are averaged over processes.
            example: what `draw` returned, of several draws joined.
            options: weights of the losses.
            mean: makes counts those of the whole batch, where processes share it.
        """
        ...


Make = Callable[[], TrainingTask]
"""A fresh, untrained network."""
Drawn = TypeVar("Drawn")


def collate(parts: Sequence[Drawn], device: torch.device) -> Drawn:
    """Return draws (dataclasses of tensors or None) joined along their first axis, on a device."""
    first: Any = parts[0]
    values = {f.name: [getattr(part, f.name) for part in parts] for f in fields(first)}
    return type(first)(
        **{k: None if v[0] is None else torch.cat(v).to(device) for k, v in values.items()}
    )


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
