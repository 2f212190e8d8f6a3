"""What the system needs to be told: threads of BLAS and limits of the machine."""

import ctypes
import os
import sys
from contextlib import AbstractContextManager
from functools import cache
from pathlib import Path
from typing import Any

from threadpoolctl import ThreadpoolController


def flush(*paths: Path) -> None:
    """Put files, and the names in folders, on the disk, where a power cut does not reach them.

    Windows flushes only files that are open for writing, and sees to its folders itself.
    """
    windows = sys.platform == "win32"
    for path in paths:
        if windows and path.is_dir():
            continue
        handle = os.open(path, os.O_RDWR if windows else os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def usable_cores() -> int:
    """Cores that this process may use; outside Linux all that the machine has."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def free_memory() -> int | None:
    """Bytes that programs may still take; None where only Linux could tell."""
    if sys.platform != "linux":
        return None
    lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
    sizes = {line.split(":")[0]: int(line.split()[1]) * 1024 for line in lines}
    return sizes.get("MemAvailable")


def give_back_memory() -> None:
    """Give memory that is free, but kept for what comes, back to the system; does nothing without glibc."""
    trim = getattr(_c_library(), "malloc_trim", None)
    if trim is not None:
        trim(0)


@cache
def _c_library() -> Any:
    if sys.platform == "linux":
        return ctypes.CDLL(None)
    return None


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def one_blas_thread() -> AbstractContextManager[object]:
    """The BLAS of numpy and scipy with one thread, in all of this process; afterwards as before."""
    return _libraries().limit(limits=1, user_api="blas")
