"""Threads of the generator: which work is done side by side; what it gives changes by last bits at most."""

from collections.abc import Generator
from contextlib import contextmanager
from itertools import pairwise

import torch

LEAST_WINDOWS = 8
"""Windows that a part of a batch has at least: of fewer than 4, matrices are multiplied by other kernels."""
LITTLE_TO_SOLVE = 1500
"""Frames of all samples together up to which one torch thread solves faster than several.

Two threads solve 1 sample of 12 s in 0.29 instead of 0.22 s and 4 in 0.83 instead of 0.77 s, but 20 in 3.3
instead of 3.6 s (2 cores).
"""
_UNROLLED = 16
"""Numbers that torch computes at once; those left over at the end are computed by other formulas."""


@contextmanager
def torch_threads(count: int) -> Generator[None]:
    """Let torch take so many threads in this thread; afterwards it takes as many as before."""
    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def batch_parts(windows: int, largest: int, threads: int) -> list[slice]:
    """Return the parts of a batch that go through a network side by side.

    Args:
        windows: in the batch.
        largest: windows that are computed at once: bounds memory.
        threads: how many parts of each `largest` help.
    """
    parts: list[slice] = []
    for first in range(0, windows, largest):
        size = min(largest, windows - first)
        parts += _split(first, size, max(1, min(threads, size // LEAST_WINDOWS)))
    return parts


def sample_groups(samples: int, frames: int, threads: int) -> list[slice]:
    """Return groups of samples that are solved side by side, as many as there are threads.

    All are one group where smaller ones would round otherwise: a single sample, and samples whose numbers
    are not computed in whole runs, are computed by other formulas.

    Args:
        samples: how many.
        frames: of each.
        threads: that help.
    """
    groups = _split(0, samples, max(1, min(threads, samples // 2)))
    whole = all((g.stop - g.start) * frames % _UNROLLED == 0 for g in groups)
    return groups if whole else [slice(0, samples)]


def _split(first: int, size: int, count: int) -> list[slice]:
    bounds = [first + k * size // count for k in range(count + 1)]
    return [slice(*pair) for pair in pairwise(bounds)]
