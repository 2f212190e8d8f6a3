"""in_child: one function call in a process of its own, which may die of what it reads."""

import json
import logging
import multiprocessing
import os
import signal
import sys
import tempfile
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from capture_app.jobs.job_record import FULL
from capture_app.web.sandbox.bounds import ProcessLimits, set_bounds
from omomo_core.errors import InputError, OmocapError

log = logging.getLogger(__name__)

_MOST_ANSWER = 64 * 2**20
_READING = "capture_app.web.sandbox.work"
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
    """What the child does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = os.fspath(scratch)
    set_bounds(bounds)
    telling.send_bytes(json.dumps(_found(work, given), allow_nan=False).encode())


def _found(work: Work, given: Any) -> dict[str, Any]:
    try:
        return {"found": work(*given)}
    except OmocapError as error:
        return {"error": _told(error)}
    except MemoryError:
        return {"error": _told(_died())}
    except Exception as error:
        if isinstance(error, OSError) and error.errno in FULL:
            return {"error": _told(_full())}
        log.exception("%s%r", work.__name__, given)
        return {"error": _told(_defect())}


def _told(error: OmocapError) -> dict[str, str]:
    return {
        "code": error.code,
        "what": error.what,
        "where": error.where,
        "field": error.field,
        "fix": error.fix,
    }


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
