"""one_ahead: the next item is made in a second thread while the last one is used."""

from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from threading import Event
from typing import TypeVar

from omomo_core.generation.result import Progress

T = TypeVar("T")


class _Abandoned(Exception):
    """Nobody waits for the next item any more."""


def one_ahead(make: Callable[[Progress], Iterator[T]], progress: Progress) -> Generator[T]:
    """Yield the items of `make`, of which the next one is always made in a second thread.

    What `make` or `progress` raises there is raised here in the item's place. When the generator is closed,
    the thread ends at its next progress, and is waited for.

    Args:
        make: makes the items, and tells its progress to what it is given.
        progress: told of it, in the second thread.
    """
    abandoned = Event()

    def told(step: str, done: float) -> None:
        if abandoned.is_set():
            raise _Abandoned
        progress(step, done)

    items = make(told)
    with ThreadPoolExecutor(1) as pool:
        try:
            coming = pool.submit(next, items, None)
            while (item := coming.result()) is not None:
                coming = pool.submit(next, items, None)
                yield item
        finally:
            abandoned.set()
