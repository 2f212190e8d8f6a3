"""The optimiser of a network: Muon for the matrices it names, AdamW for everything else."""

import torch
from torch import Tensor, nn

from omomo_core.learning.training.muon import Muon
from omomo_core.learning.training.trainee import Trainee

MUON_RATE = 4.0
"""Muon's steps against AdamW's: orthogonal ones bear to be larger."""


class Optimiser:
    """One learning rate for both.

    Muon (Jordan et al. 2024) brings our stages as far in 500 steps as AdamW in more than 1,000; the
    paper's networks keep to AdamW.
    """

    def __init__(self, trainee: Trainee, rate: float) -> None:
        blocks = list(trainee.muon)
        inside = {id(p) for p in blocks}
        others = [p for p in trainee.network.parameters() if id(p) not in inside]
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
        """What a resumed run needs, by name."""
        return {
            f"{k}.{i}.{name}": value.contiguous()
            for k, (part, _) in enumerate(self._parts)
            for i, moments in part.state_dict()["state"].items()
            for name, value in moments.items()
        }

    def load(self, tensors: dict[str, Tensor]) -> None:
        """Take up what `tensors` returned."""
        for k, (part, _) in enumerate(self._parts):
            moments: dict[int, dict[str, Tensor]] = {}
            for key, value in tensors.items():
                which, index, name = key.split(".", 2)
                if int(which) == k:
                    moments.setdefault(int(index), {})[name] = value
            groups = part.state_dict()["param_groups"]
            part.load_state_dict({"state": moments, "param_groups": groups})
