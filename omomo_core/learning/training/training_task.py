"""TrainingTask: what the training loop asks of a network, its examples and its loss."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, runtime_checkable

import torch
from jaxtyping import Float
from torch import Tensor, nn

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
        """Of its file."""
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
