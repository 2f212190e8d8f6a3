"""With how many threads torch generates: little work is done sooner by one."""

from collections.abc import Generator
from contextlib import contextmanager

import torch

LITTLE = 1500
"""Frames of all samples together, up to which threads wait for each other longer than they help:
of takes of 4 s one thread makes 1 sample in 0.43 s and 4 in 0.77, two make them in 0.49 and 0.93;
20 are as fast either way (2 cores)."""


@contextmanager
def threads_for(frames: int) -> Generator[None]:
    """As many threads as help; afterwards as many as before.

    Args:
        frames: of all samples together.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1 if frames <= LITTLE else before)
    try:
        yield
    finally:
        torch.set_num_threads(before)
