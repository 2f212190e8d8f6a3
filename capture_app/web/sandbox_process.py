"""Slow work on what was uploaded, in child processes whose time and memory are bounded."""

import asyncio
import json
import logging
import mmap
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from capture_app.jobs.job_record import FULL
from omomo_core.errors import InputError, OmocapError

GIB = 2**30


@dataclass(frozen=True)
class ProcessLimits:
    """Limits of one piece of work."""

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


log = logging.getLogger(__name__)

_MOST_ANSWER = 64 * 2**20
_READING = "capture_app.web.sandboxed_work"
_DRAWING = ("capture_app.replay.scene_pack", "capture_app.posters")
if sys.platform == "win32":
    _context = multiprocessing.get_context("spawn")
else:
    # Children are forked from a process that has the libraries loaded: they start in milliseconds.
    _context = multiprocessing.get_context("forkserver")
    _context.set_forkserver_preload([_READING])


def warm_up() -> None:
    """Load all that children share now, so that nobody waits for it later."""
    if sys.platform != "win32":
        from multiprocessing import forkserver

        _context.set_forkserver_preload([_READING, *_DRAWING])
        forkserver.ensure_running()


Work = Callable[..., dict[str, Any]]
"""A function of a module, of paths and numbers; what it finds is JSON."""


def in_child(work: Work, *given: Any, scratch: Path, bounds: ProcessLimits) -> dict[str, Any]:
    """Call a function in a bounded child process and wait for it.

    What the child says is read as JSON: nothing that a hostile file makes of it runs here.

    Args:
        work: the function; what it writes must appear whole.
        given: its arguments.
        scratch: a folder for its temporary files, empty again in the end.
        bounds: what it may use.

    Raises:
        InputError: as the function, or "too-slow" or "too-much" when it met a bound.
    """
    listening, telling = _context.Pipe(duplex=False)
    child = _context.Process(
        target=_work, args=(telling, work, given, scratch, bounds), daemon=True
    )
    child.start()
    telling.close()
    try:
        if not listening.poll(bounds.seconds):
            raise _too_slow(bounds)
        answer = json.loads(listening.recv_bytes(_MOST_ANSWER))
    except (EOFError, OSError) as error:
        raise _died() from error
    finally:
        child.kill()
        child.join()
        child.close()
        listening.close()
    if "error" in answer:
        raise InputError(**answer["error"])
    return answer["found"]


def _work(
    telling: Connection, work: Work, given: Any, scratch: Path, bounds: ProcessLimits
) -> None:
    """Do the work of a child process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = os.fspath(scratch)
    set_bounds(bounds)
    telling.send_bytes(json.dumps(_found(work, given), allow_nan=False).encode())


def _found(work: Work, given: Any) -> dict[str, Any]:
    try:
        return {"found": work(*given)}
    except OmocapError as error:
        return {"error": error.texts}
    except MemoryError:
        return {"error": _died().texts}
    except Exception as error:
        if isinstance(error, OSError) and error.errno in FULL:
            return {"error": _full().texts}
        log.exception("%s%r", work.__name__, given)
        return {"error": _defect().texts}


def _too_slow(bounds: ProcessLimits) -> InputError:
    return InputError(
        "too-slow",
        f"Reading it took more than {bounds.seconds:.0f} seconds, and was given up.",
        fix="Bring less at once: a shorter recording, or a simpler mesh.",
    )


def _died() -> InputError:
    return InputError(
        "too-much",
        "Reading it needs more memory than is given to one file, or broke the reader.",
        fix="Bring less at once, or open it in the program that made it and save it again.",
    )


def _full() -> InputError:
    return InputError("disk-full", "The disk is full.", fix="Make room on it, and try again.")


def _defect() -> InputError:
    return InputError(
        "not-read",
        "Reading it failed in a way that the program does not know.",
        fix="Try another file; the server's log tells what to report.",
    )


AT_ONCE = 2


class SandboxPool:
    """A queue of such work; waiting in it keeps nobody else from being served."""

    def __init__(
        self, scratch: Path, bounds: ProcessLimits | None = None, *, at_once: int = AT_ONCE
    ) -> None:
        self._scratch = scratch
        self._bounds = bounds or ProcessLimits()
        self._threads = ThreadPoolExecutor(at_once, thread_name_prefix="heavy")
        self._running: dict[tuple[Any, ...], asyncio.Future[dict[str, Any]]] = {}

    async def run(self, work: Work, *given: Any) -> dict[str, Any]:
        """Call a function in a child; who asks for the same meanwhile gets the same answer.

        Raises:
            InputError: as `in_child`.
        """
        key = (work, *given)
        running = self._running.get(key)
        if running is None:
            loop = asyncio.get_running_loop()
            running = loop.run_in_executor(self._threads, self._call, work, given)
            self._running[key] = running
            running.add_done_callback(lambda _: self._running.pop(key, None))
        # One who goes away does not take the answer from the others.
        return await asyncio.shield(running)

    def close(self) -> None:
        """Begin nothing more."""
        self._threads.shutdown(wait=False, cancel_futures=True)

    def _call(self, work: Work, given: tuple[Any, ...]) -> dict[str, Any]:
        scratch = Path(tempfile.mkdtemp(dir=self._scratch))
        try:
            return in_child(work, *given, scratch=scratch, bounds=self._bounds)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
