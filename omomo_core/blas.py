"""Linear algebra of small matrices by one thread: several wait for each other longer than they work."""

from contextlib import AbstractContextManager
from functools import cache

from threadpoolctl import ThreadpoolController


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def one_blas_thread() -> AbstractContextManager[object]:
    """The BLAS of numpy and scipy with one thread, in all of this process; afterwards as before."""
    return _libraries().limit(limits=1, user_api="blas")
