"""How many threads torch takes: little work is faster with one."""

from collections.abc import Generator
from contextlib import contextmanager

import torch

LITTLE_TO_SAMPLE = 300
"""Frames of all samples together up to which one thread samples faster than several.

Two threads sample 1 sample of 4 s in 0.19 s, as one thread does; 1 of 12 s in 0.54 instead of 0.68 s and 4
of 12 s in 1.7 instead of 2.7 s (2 cores).
"""
LITTLE_TO_SOLVE = 1500
"""Frames of all samples together up to which one thread solves faster than several.

Two threads solve 1 sample of 12 s in 0.29 instead of 0.22 s and 4 in 0.83 instead of 0.77 s, but 20 in 3.3
instead of 3.6 s (2 cores).
"""


@contextmanager
def threads_for(frames: int, little: int, most: int) -> Generator[None]:
    """Limit torch to as many threads as help; afterwards it has as many as before.

    Args:
        frames: of all samples together.
        little: up to so many frames, one thread is faster.
        most: threads for more frames.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1 if frames <= little else most)
    try:
        yield
    finally:
        torch.set_num_threads(before)
