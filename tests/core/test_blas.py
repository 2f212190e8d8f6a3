"""Small systems are solved by one thread, and other work gets its threads back."""

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from omomo_core.system import one_blas_thread


def _threads() -> list[int]:
    return [lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"]


def test_blas_has_one_thread_inside_and_as_many_as_before_afterwards():
    with threadpool_limits(2, "blas"):
        before = _threads()
        assert max(before) == 2
        with one_blas_thread():
            assert set(_threads()) == {1}
        assert _threads() == before


def test_threads_come_back_after_an_error():
    with threadpool_limits(2, "blas"):
        with pytest.raises(KeyboardInterrupt), one_blas_thread():
            raise KeyboardInterrupt
        assert max(_threads()) == 2
