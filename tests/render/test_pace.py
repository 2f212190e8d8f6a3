"""Working ahead and beside: the same items in order, errors where they belong, no thread left."""

import threading
import time
from collections.abc import Iterator

import pytest

from render.video import ahead, beside


def nobody_left() -> bool:
    return not [t for t in threading.enumerate() if t.name in ("ahead", "beside")]


def test_items_come_in_order_while_the_next_are_made() -> None:
    def slow() -> Iterator[int]:
        for k in range(8):
            time.sleep(0.03)
            yield k

    start = time.perf_counter()
    seen = []
    for item in ahead(slow()):
        time.sleep(0.03)
        seen.append(item)
    assert seen == list(range(8))
    assert time.perf_counter() - start < 0.46  # one after the other takes 0.48
    assert nobody_left()


def test_an_error_in_making_comes_after_the_items_before_it() -> None:
    def broken() -> Iterator[int]:
        yield 1
        raise ValueError("torn")

    items = ahead(broken())
    assert next(items) == 1
    with pytest.raises(ValueError, match="torn"):
        next(items)
    assert nobody_left()


def test_leaving_early_closes_the_source_in_its_own_thread() -> None:
    closed: list[str] = []

    def endless() -> Iterator[int]:
        try:
            while True:
                yield 0
        finally:
            closed.append(threading.current_thread().name)

    items = ahead(endless())
    next(items)
    items.close()
    assert closed == ["ahead"]
    assert nobody_left()


def test_work_beside_is_done_in_order_and_finished_at_the_end() -> None:
    done: list[tuple[int, str]] = []

    def use(item: int) -> None:
        time.sleep(0.005)
        done.append((item, threading.current_thread().name))

    with beside(use) as give:
        for k in range(10):
            give(k)
    assert done == [(k, "beside") for k in range(10)]
    assert nobody_left()


def test_an_error_beside_stops_who_gives() -> None:
    def use(item: int) -> None:
        raise OSError(28, "full")

    given = 0
    with pytest.raises(OSError, match="full"), beside(use) as give:  # noqa: PT012
        for k in range(1000):
            give(k)
            given = k
    assert given < 10
    with pytest.raises(OSError, match="full"), beside(use) as give:
        give(1)  # is raised at the end at the latest
    assert nobody_left()


def test_an_error_of_who_gives_is_theirs() -> None:
    with pytest.raises(RuntimeError, match="renderer"), beside(lambda item: None) as give:  # noqa: PT012
        give(1)
        raise RuntimeError("the renderer died")
    assert nobody_left()
