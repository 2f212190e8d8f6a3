"""What a child process may use, and the setting of it from inside."""

import mmap
import sys
from dataclasses import dataclass
from pathlib import Path

GIB = 2**30


@dataclass(frozen=True)
class ProcessLimits:
    """For one piece of work."""

    seconds: float = 120.0
    """On the clock; of the processor twice that, over all cores."""
    memory: int = 4 * GIB
    """Bytes beside what an idle child has."""
    written: int = 20 * GIB
    """Bytes of one file."""


def set_bounds(bounds: ProcessLimits) -> None:
    """Bind the process that calls this; where the system has no such bounds, time alone is kept."""
    if sys.platform == "win32":
        return
    import resource as r

    limits = {
        r.RLIMIT_CPU: int(2 * bounds.seconds) + 1,
        r.RLIMIT_FSIZE: bounds.written,
        r.RLIMIT_CORE: 0,
    }
    if sys.platform == "linux":
        # Beside the address space that the libraries have taken already.
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        limits[r.RLIMIT_AS] = pages * mmap.PAGESIZE + bounds.memory
    for limit, value in limits.items():
        hard = r.getrlimit(limit)[1]
        most = value if hard == r.RLIM_INFINITY else min(value, hard)
        r.setrlimit(limit, (most, most))
