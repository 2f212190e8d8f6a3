"""Commands that run until they are told to stop."""

import signal
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager


@contextmanager
def until_stopped() -> Generator[Callable[[], object]]:
    """Gives a function that waits for SIGINT or SIGTERM, which meanwhile do nothing else."""
    stop = threading.Event()
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: stop.set()) for number in numbers]
    try:
        yield stop.wait
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
