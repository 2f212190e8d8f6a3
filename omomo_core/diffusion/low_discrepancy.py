"""A low-discrepancy sequence: any consecutive few of its numbers are spread evenly over [0, 1)."""

from jaxtyping import Float, Int
from torch import Tensor

GOLDEN = (5**0.5 - 1) / 2


def golden_sequence(number: Int[Tensor, "*b"]) -> Float[Tensor, "*b"]:
    """Return the terms of the additive golden-ratio sequence in [0, 1) with these indices."""
    return (GOLDEN * (number + 0.5)) % 1.0
