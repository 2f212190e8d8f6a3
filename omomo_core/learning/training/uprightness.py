"""How upright a person stays, among all whose hands go as low: what stage 2 is told of their habits."""

import torch
from jaxtyping import Float
from torch import Tensor

_STEP = 0.08
"""Metres of palm height that count as equally low."""
_BINS = 20
_QUANTILES = 65
_FEWEST = 200
"""Windows in a bin, at least; with less, its neighbours' count too."""


class Uprightness:
    """Ranks of pelvis heights among windows whose lowest palm is at about the same height.

    Palms do not say whether somebody stoops or squats for what lies low. A rank says it on one scale for
    all heights: 0 is the deepest squat, 1 the straightest legs.
    """

    def __init__(self, palm: Float[Tensor, " windows"], pelvis: Float[Tensor, " windows"]) -> None:
        """Of the lowest palm and the lowest pelvis in each of many windows, metres."""
        levels = torch.linspace(0, 1, _QUANTILES)
        self._table = torch.stack([_near(palm, pelvis, k).quantile(levels) for k in range(_BINS)])

    def __call__(
        self, palm: Float[Tensor, " b"], pelvis: Float[Tensor, " b"]
    ) -> Float[Tensor, " b"]:
        """The rank in [0, 1] of each window."""
        row = self._table[_bin(palm)]
        above = torch.searchsorted(row, pelvis[:, None]).clamp(1, _QUANTILES - 1)
        low, high = row.gather(1, above - 1)[:, 0], row.gather(1, above)[:, 0]
        part = ((pelvis - low) / (high - low).clamp(min=1e-6)).clamp(0, 1)
        return (above[:, 0] - 1 + part) / (_QUANTILES - 1)


def _bin(palm: Float[Tensor, " b"]) -> Tensor:
    return (palm / _STEP).long().clamp(0, _BINS - 1)


def _near(palm: Tensor, pelvis: Tensor, k: int) -> Float[Tensor, " windows"]:
    """Pelvis heights of the bin, widened until there are enough."""
    away = (_bin(palm) - k).abs()
    for wider in range(_BINS):
        some = pelvis[away <= wider]
        if len(some) >= _FEWEST:
            return some
    return pelvis
