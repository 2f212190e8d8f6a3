"""What a child process may use, and the setting of it from inside."""

import sys
from dataclasses import dataclass

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

    _at_most(r.RLIMIT_CPU, int(2 * bounds.seconds) + 1)
    _at_most(r.RLIMIT_FSIZE, bounds.written)
    _at_most(r.RLIMIT_CORE, 0)
    if sys.platform == "linux":
        _at_most(r.RLIMIT_AS, _mapped() + bounds.memory)


def _at_most(what: int, value: int) -> None:
    import resource

    hard = resource.getrlimit(what)[1]
    if hard != resource.RLIM_INFINITY:
        value = min(value, hard)
    resource.setrlimit(what, (value, value))


def _mapped() -> int:
    """Bytes of address space that the libraries have taken already."""
    with open("/proc/self/statm", encoding="ascii") as file:
        pages = int(file.read().split()[0])
    import resource

    return pages * resource.getpagesize()
