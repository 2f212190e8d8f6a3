"""smoothed: semi-global matching (Hirschmüller 2008), along the four directions of the picture."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from jaxtyping import Int16, UInt8, UInt16

_STEP, _LEAP = 6, 48
"""What it costs that a pixel lies one depth, or many, from the one beside it."""
_EDGE = 8
"""Difference of grey levels beyond which a leap costs less: surfaces end where colours change."""

Costs = UInt16[np.ndarray, "lanes depths"]


def smoothed(
    costs: UInt8[np.ndarray, "h w depths"], grey: UInt8[np.ndarray, "h w"]
) -> UInt16[np.ndarray, "h w depths"]:
    """Costs of each pixel's depths together with what they cost the pixels around it."""
    total = np.zeros(costs.shape, np.uint16)
    light = grey.astype(np.int16)
    _sweep(costs, light, total)
    # Columns instead of rows: views on the same memory.
    _sweep(costs.swapaxes(0, 1), light.T, total.swapaxes(0, 1))
    return total


def _sweep(
    costs: UInt8[np.ndarray, "n lanes depths"],
    grey: Int16[np.ndarray, "n lanes"],
    total: UInt16[np.ndarray, "n lanes depths"],
) -> None:
    """Add the costs of paths along the first axis, there and back."""
    for order in (range(len(costs)), range(len(costs) - 1, -1, -1)):
        for index, path in _paths(costs, grey, order):
            total[index] += path


def _paths(
    costs: UInt8[np.ndarray, "n lanes depths"], grey: Int16[np.ndarray, "n lanes"], order: range
) -> Iterator[tuple[int, Costs]]:
    before = costs[order[0]].astype(np.uint16)
    yield order[0], before
    for last, index in pairwise(order):
        least = before.min(axis=1, keepdims=True)
        change = np.maximum(np.abs(grey[index] - grey[last]), _EDGE)
        leap = np.maximum(_LEAP * _EDGE // change, _STEP + 2).astype(np.uint16)
        best = np.minimum(before, least + leap[:, None])
        np.minimum(best[:, 1:], before[:, :-1] + np.uint16(_STEP), out=best[:, 1:])
        np.minimum(best[:, :-1], before[:, 1:] + np.uint16(_STEP), out=best[:, :-1])
        before = costs[index] + best - least
        yield index, before
