"""Work ahead: an iterator that runs in a thread of its own, a few items before who uses it."""

from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import Generic, TypeVar

_T = TypeVar("_T")
_DEPTH = 3
"""Items that may wait; pictures are large."""
_PATIENCE = 0.1
"""Seconds after which a waiting thread looks whether it is still wanted."""


class _End:
    """What comes after the last item: an error, or nothing."""

    def __init__(self, error: BaseException | None) -> None:
        self.error = error


class _Belt(Generic[_T]):
    """A short queue that both sides can leave."""

    def __init__(self) -> None:
        self._items: Queue[_T | _End] = Queue(_DEPTH)
        self.left = Event()
        """Who takes the items has gone."""

    def put(self, item: _T | _End) -> bool:
        """Wait for a place; False when nobody wants it any more."""
        while not self.left.is_set():
            try:
                self._items.put(item, timeout=_PATIENCE)
                return True
            except Full:
                continue
        return False

    def take(self) -> Generator[_T]:
        """The items up to the end; the error that ended them is raised here."""
        while True:
            item = self._items.get()
            if isinstance(item, _End):
                if item.error is not None:
                    raise item.error
                return
            yield item

    def drop(self) -> None:
        """Take what is left, so that nobody waits for a place."""
        self.left.set()
        try:
            while True:
                self._items.get_nowait()
        except Empty:
            return


def ahead(items: Iterable[_T]) -> Generator[_T]:
    """The same items, made in another thread while the ones before are used.

    An error in making them is raised where they are used. When the user leaves early, making stops
    and the source is closed.
    """
    belt = _Belt[_T]()

    def make() -> None:
        error: BaseException | None = None
        try:
            for item in items:
                if not belt.put(item):
                    break
        except BaseException as problem:  # handed over, not hidden
            error = problem
        finally:
            if isinstance(items, Generator):
                items.close()
        belt.put(_End(error))

    maker = Thread(target=make, name="ahead", daemon=True)
    maker.start()
    try:
        yield from belt.take()
    finally:
        belt.drop()
        maker.join()


@contextmanager
def beside(use: Callable[[_T], None]) -> Generator[Callable[[_T], None]]:
    """A function that hands items to `use`, which works on them in another thread, in order.

    The block ends when all are done. An error in `use` is raised at the next item, or at the end.
    """
    belt, failed = _Belt[_T](), list[BaseException]()

    def work() -> None:
        try:
            for item in belt.take():
                use(item)
        except BaseException as problem:  # handed over, not hidden
            failed.append(problem)
            belt.drop()

    def give(item: _T) -> None:
        if not belt.put(item):
            raise failed[0]

    worker = Thread(target=work, name="beside", daemon=True)
    worker.start()
    try:
        yield give
        belt.put(_End(None))
    except BaseException:
        belt.put(_End(None))
        raise
    finally:
        worker.join()
    if failed:
        raise failed[0]
