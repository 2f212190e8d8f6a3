"""Computing: the device, its precision, torch's threads, and pools of worker processes."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, Literal

import torch

from omomo_core.errors import InputError

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


Device = Literal["cpu", "cuda", "mps"]


def find_device(name: Device) -> torch.device:
    """Return the device of that name.

    Raises:
        InputError: "device-missing" where PyTorch finds none on this machine.
    """
    if not _is_there(name):
        raise InputError(
            "device-missing",
            f"PyTorch {torch.__version__} finds no device {name} on this machine.",
            where=f"‹device› {name}",
            fix="Run on the processor (‹device› cpu), or install the driver of the graphics card and "
            "the build of PyTorch for it (docs/platforms.md).",
        )
    return torch.device(name)


def _is_there(name: Device) -> bool:
    if name == "cuda":
        return torch.cuda.is_available()
    return name == "cpu" or torch.backends.mps.is_available()


def quick_in_bf16(device: torch.device) -> bool:
    """Whether matrix products in bfloat16 take less time than in single precision.

    A processor without such units emulates them, 20 times as slowly.
    """
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported(including_emulation=False)
    if device.type != "cpu":
        return True
    able = torch.cpu.get_capabilities()
    return bool(able.get("amx_bf16") or able.get("avx512_bf16"))


@contextmanager
def worker_pool(
    workers: int, start: Callable[..., None], *shared: Any
) -> Generator[ProcessPoolExecutor]:
    """A pool of processes with one thread each.

    Args:
        workers: how many processes.
        start: called with `shared` in each process before it works; a function of a module.
        shared: sent to each process once.
    """
    # Spawned, not forked: a forked process may hang in torch's threads.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, _begin, (start, *shared))
    try:
        yield pool
    finally:
        # An interrupted caller waits for what is in hand, not for all that was asked for.
        pool.shutdown(cancel_futures=True)


def _begin(start: Callable[..., None], *shared: Any) -> None:
    # Ctrl-C reaches every process of the terminal; the first one decides what it means.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    torch.set_num_threads(1)
    start(*shared)


def _end_with_parent() -> None:
    """End a worker whose parent was killed, which would otherwise wait for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
