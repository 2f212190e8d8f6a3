"""A worker: one process that does one job at a time, and takes jobs over from workers that died.

It is made to be killed: whatever kills it, what it was at is found by another one, or by the next one
to be started, which goes on after the last finished stage. So it also ends itself, at once and
without ceremony, when it finds that others have taken it for dead, or that it cannot trust its own
state; SIGTERM is the same with notice, so that nobody has to wait until it is missed.
"""

import logging
import os
import signal
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn
from uuid import uuid4

from capture_app.jobs import engine
from capture_app.jobs.claimed_job import ClaimedJob
from capture_app.jobs.database import Database
from capture_app.jobs.fleet import LOST, NO_ROOM
from capture_app.jobs.job_kinds import KINDS, JobKind
from capture_app.jobs.job_record import no_room
from capture_app.jobs.worker_store import WorkerStore, worker_name

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Tempo:
    """Intervals of what a worker does besides its job, seconds."""

    report: float = 0.3
    """Writes progress, and looks whether the job was cancelled."""
    beat: float = 1.0
    """Says that it lives."""
    silence: float = 12.0
    """After so long without a beat a worker is dead."""
    sweep: float = 2.0
    """Looks for dead workers."""
    cancel_within: float = 5.0
    """After so long a cancelled job that has not heard of it is left in the middle, and the worker with it,
    which costs the next job the time in which a new one loads its libraries."""


def work(
    database_url: str,
    *,
    tempo: Tempo | None = None,
    kinds: Mapping[str, JobKind] = KINDS,
    warm_up: Callable[[], object] = lambda: None,
) -> None:
    """Do jobs until SIGTERM or SIGINT; the first one when `warm_up` is over.

    Raises:
        InputError: the database cannot be used.
    """
    Worker(Database(database_url), tempo or Tempo(), kinds, warm_up).run()


class Worker:
    """This process.

    The threads: the jobs' (of DBOS), the pulse, the one that warms up, and the main one, which sweeps.
    """

    def __init__(
        self,
        database: Database,
        tempo: Tempo,
        kinds: Mapping[str, JobKind],
        warm_up: Callable[[], object],
    ) -> None:
        """Nothing is done yet."""
        name = worker_name(os.getpid(), uuid4().hex[:6])
        self._store = WorkerStore(database, name)
        self._tempo, self._kinds = tempo, kinds
        self._task: ClaimedJob | None = None
        self._stop = threading.Event()
        self._warming, self._warm = warm_up, threading.Event()

    def run(self) -> NoReturn:
        """Work until told to stop."""
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: self._stop.set())
        self._store.join()
        threading.Thread(target=self._pulse, daemon=True, name="pulse").start()
        threading.Thread(target=self._warm_up, daemon=True, name="warm-up").start()
        try:
            engine.launch(self._store.database, self._store.worker, self._perform)
        except Exception as error:
            self._exit_process("the queue cannot be worked for", error)
        _log.info("%s is ready.", self._store.worker)
        while True:
            self._sweep()
            if self._stop.wait(self._tempo.sweep):
                self._leave()

    def _warm_up(self) -> None:
        try:
            self._warming()
        except Exception:  # a job that needs the same will tell
            _log.exception("The worker could not warm up.")
        finally:
            self._warm.set()

    def _sweep(self) -> None:
        """Free the jobs of dead workers, in an order in which it may be broken off anywhere."""
        try:
            # Asked first: who is not alive afterwards is dead, and not new.
            begun = engine.running()
            living = self._store.free_silent(self._tempo.silence)
            dead = set(begun.values()) - living
            if dead:
                _log.warning("Taking over from %s.", ", ".join(sorted(dead)))
                engine.release(dead)
        except Exception:
            _log.exception("The sweep failed; it will be tried again.")

    def _pulse(self) -> None:
        """Beat and report, until a beat could not be written for so long that others free our jobs."""
        tempo, last = self._tempo, time.monotonic()
        while True:
            try:
                if time.monotonic() - last >= tempo.beat:
                    if not self._store.beat():
                        self._exit_process("others have taken it for dead")
                    last = time.monotonic()
                if (task := self._task) is not None:
                    if task.report() > tempo.cancel_within:
                        self._leave()  # nobody can stop a thread that does not listen
                    task.let_others_first()
            except Exception as error:
                _log.warning("The database did not answer: %s", error)
                if time.monotonic() - last > tempo.silence:
                    self._exit_process("the database does not answer", error)
            time.sleep(tempo.report)

    def _perform(self, job_id: str, workflow: str) -> None:
        """Do a job, or go on with it."""
        self._warm.wait()  # two threads that load the same libraries are in each other's way
        try:
            row = self._store.claim(job_id, workflow)
            if row is None:
                return
            self._task = ClaimedJob(self._store, row, self._kinds)
            self._task.run()
        except BaseException as error:
            _log.error("Job %s: its state is not known.", job_id)
            self._exit_process("it cannot trust its own state", error)
        finally:
            self._task = None

    def _leave(self) -> NoReturn:
        """Hand back what this worker is at, for another one or the next one."""
        try:
            self._store.leave()
        except Exception as error:
            self._exit_process("it cannot hand back its job", error)
        _log.info("%s has stopped.", self._store.worker)
        self._exit(0)

    def _exit_process(self, why: str, error: BaseException | None = None) -> NoReturn:
        _log.error("%s ends: %s.", self._store.worker, why, exc_info=error)
        self._exit(NO_ROOM if error is not None and no_room(error) else LOST)

    @staticmethod
    def _exit(code: int) -> NoReturn:
        logging.shutdown()
        os._exit(code)  # threads in the middle of a job are not waited for: their work is kept


def warm_up() -> None:
    """Load what makes a motion, and make the example's in one step; nothing is written.

    Libraries and networks take longer to load than a short take to generate, and all of them are slower
    the first time.
    """
    from capture_app.commands.run import RunRequest
    from capture_app.pipeline import prepare_take
    from capture_app.posters import person_picture
    from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
    from omomo_core.generation.generator import generate

    example = RunRequest(
        session=DEMO / SESSION,
        object=DEMO / MESH,
        mount=DEMO / MOUNT,
        samples=1,
        steps=1,
        output=Path("nowhere"),
    )
    take = prepare_take(example)
    made = generate(take.motion, take.body, take.stages, example.generation)
    person_picture(made.people[made.chosen], take.motion, take.body)
