"""Numbers that lie evenly, however many of them are taken and from wherever on."""

from jaxtyping import Float, Int
from torch import Tensor

GOLDEN = (5**0.5 - 1) / 2


def golden_sequence(number: Int[Tensor, "*b"]) -> Float[Tensor, "*b"]:
    """Places between 0 and 1 of the first numbers, any few that follow each other spread over all:
    multiples of the golden section.
    """
    return (GOLDEN * (number + 0.5)) % 1.0
