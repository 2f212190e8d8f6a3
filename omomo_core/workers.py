"""Pools of worker processes that get shared data once, and end with the process that started them."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any

import torch


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
