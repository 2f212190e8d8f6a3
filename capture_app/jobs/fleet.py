"""Workers of this machine: started, watched, started again when one dies, stopped together."""

import logging
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

DATABASE = "OMOCAP_DATABASE"
"""Environment variable with the address of a worker's database."""
LOG = "OMOCAP_WORKER_LOG"
"""Environment variable with the file of a worker's log."""
FOLLOW = "OMOCAP_WORKER_FOLLOWS"
"""Environment variable that lets a worker end with its standard input."""

_log = logging.getLogger(__name__)

NO_ROOM = 28
"""Exit code of a worker whose disk is full."""
LOST = 70
"""Exit code of a worker that cannot go on for another reason than its job."""
_MEANT = (0, 1, 2, NO_ROOM, LOST)
"""Exit codes of a worker that ended by itself, for no fault of its job."""
_COMMAND = (sys.executable, "-m", "capture_app.jobs")
_SOON = 10.0
"""Seconds; a worker that ends sooner may do so again, and is started again later each time."""


class Fleet:
    """Worker processes that end when this process does, however it ends."""

    def __init__(
        self,
        database_url: str,
        count: int = 1,
        *,
        log: Path | None = None,
        command: Sequence[str] = _COMMAND,
        longest_wait: float = 30.0,
        died: Callable[[int], object] = lambda pid: None,
    ) -> None:
        """Nothing is started yet.

        Args:
            database_url: of the jobs.
            count: processes; each does one job at a time.
            log: file that they append to; their standard error if not given.
            command: of one process.
            longest_wait: seconds before one that dies again and again is started again.
            died: told the process id of one that was killed or crashed while this process lives, as
                `JobQueue.worker_died` wants to know.
        """
        self._command, self._longest_wait, self._died = list(command), longest_wait, died
        self._codes: dict[int, int] = {}
        self._environment = _environment(database_url, count, log)
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._processes: dict[int, subprocess.Popen[bytes]] = {}
        self._keepers = [
            threading.Thread(target=self._keep, args=(k,), daemon=True) for k in range(count)
        ]

    def start(self) -> None:
        """Start them; returns at once."""
        for keeper in self._keepers:
            keeper.start()

    def stop(self, patience: float = 10.0) -> None:
        """Let each hand back its job, and wait until they are gone; called twice, do nothing."""
        self._stop.set()
        with self._lock:
            processes = list(self._processes.values())
            for process in processes:
                process.terminate()
        deadline = time.monotonic() + patience
        for process in processes:
            try:
                process.wait(max(0.1, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                process.kill()
        for keeper in self._keepers:
            if keeper.is_alive():
                keeper.join()

    @property
    def alive(self) -> bool:
        """At least one worker runs now."""
        with self._lock:
            return any(process.poll() is None for process in self._processes.values())

    @property
    def full(self) -> bool:
        """A worker that ended last had found the disk full."""
        with self._lock:
            return any(code == NO_ROOM for code in self._codes.values())

    def _keep(self, number: int) -> None:
        """Have one worker run, always."""
        wait = 0.0
        while not self._stop.wait(wait):
            begin = time.monotonic()
            process = self._begin(number)
            if process is None:
                return
            code = process.wait()
            if process.stdin is not None:
                process.stdin.close()
            with self._lock:
                self._codes[number] = code
            if code not in _MEANT and not self._stop.is_set():
                self._tell_death(process.pid)
            soon = code != 0 and time.monotonic() - begin < _SOON
            wait = min(2 * wait + 0.5, self._longest_wait) if soon else 0.0

    def _tell_death(self, pid: int) -> None:
        try:
            self._died(pid)
        except Exception:  # it is missed later, like one of another machine
            _log.exception("The death of worker process %d could not be noted.", pid)

    def _begin(self, number: int) -> subprocess.Popen[bytes] | None:
        with self._lock:
            if self._stop.is_set():
                return None
            # A session of its own: Ctrl-C is for us, and we tell them. The pipe ends when we do.
            process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                env=self._environment,
                start_new_session=True,
            )
            self._processes[number] = process
            return process


def _environment(database_url: str, count: int, log: Path | None) -> dict[str, str]:
    """Return the workers' environment: each may use its share of the cores, and waits without spinning."""
    cores = max(1, (os.cpu_count() or 1) // max(1, count))
    shared = {} if count == 1 else {"OMP_NUM_THREADS": str(cores)}
    variables = {DATABASE: database_url, FOLLOW: "1", **({LOG: str(log)} if log else {})}
    return {"OMP_WAIT_POLICY": "PASSIVE", **shared, **os.environ, **variables}
