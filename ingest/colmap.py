"""pycolmap, imported through here alone: it takes SIGTERM away from the process, which gets it back.

Whoever is told to stop then stops as it means to, and prints no stack trace of COLMAP's.
"""

import ctypes
import signal
import sys
from collections.abc import Generator
from contextlib import contextmanager

_ROOM = 256
"""Bytes, more than any system's struct sigaction has."""


@contextmanager
def _sigterm_kept() -> Generator[None]:
    """Keep the process's handler of SIGTERM, whatever the block installs."""
    if sys.platform == "win32":
        yield
        return
    # Python's own signal module could not do it in any thread but the first.
    libc, kept = ctypes.CDLL(None), ctypes.create_string_buffer(_ROOM)
    libc.sigaction(int(signal.SIGTERM), None, kept)
    yield
    libc.sigaction(int(signal.SIGTERM), kept, None)


with _sigterm_kept():
    import pycolmap

__all__ = ["pycolmap"]
