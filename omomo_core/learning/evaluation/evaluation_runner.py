"""EvaluationRunner: asks tasks about recorded clips in one or several processes, and keeps every answer."""

import atexit
import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass, field
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from omomo_core.compute import worker_pool
from omomo_core.errors import InputError, OmocapError
from omomo_core.learning.evaluation.clip_sources import Recorded
from omomo_core.learning.evaluation.metrics import Row
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.evaluation.truth import MeasuredSamples, Truth
from omomo_core.stages.network_file import Header, digest_of

MEASURES = 2
"""Raised whenever the same people would be measured otherwise."""


@dataclass(frozen=True)
class Task:
    """One task: a method or protocol, a clip or a window of it, and whether the first frame is given."""

    method: str
    window: str
    first_frame: bool


@dataclass(frozen=True)
class Answer:
    """K people for one task, measured as `MeasuredSamples`; or why there are none."""

    task: Task
    given: str
    """Digest of the window."""
    weights: str
    """Digest of the method's networks."""
    one: Row = field(default_factory=dict)
    best: Row = field(default_factory=dict)
    mean: Row = field(default_factory=dict)
    problem: str = ""


class AnswerLog:
    """A file of answers: a line of settings, then one an answer."""

    def __init__(self, path: Path | None, settings: Mapping[str, Any]) -> None:
        """Open the file, or begin it.

        Args:
            path: of the file, whose folder is made if it is not there; None keeps nothing on the disk.
            settings: what every answer depends on.

        Raises:
            InputError: ``answers-differ`` or ``answers-damaged``.
        """
        self.path = path
        lines = self._lines()
        if not lines:
            self._append(settings)
            lines = [dict(settings)]
        before = lines[0]
        changed = [k for k in {**before, **settings} if before.get(k) != settings.get(k)]
        if changed:
            changes = ", ".join(f"{k} was {before.get(k)}, now {settings.get(k)}" for k in changed)
            raise self._differs(changes)
        self.answers = self._answers(lines[1:])

    def add(self, answer: Answer) -> None:
        """Keep an answer; it is on the disk when this returns."""
        self.answers[answer.task] = answer
        self._append(asdict(answer))

    def find(self, task: Task, given: str, weights: str) -> Answer | None:
        """The answer that is kept for a task.

        Raises:
            InputError: ``answers-differ`` when the window or the weights are not what they were.
        """
        answer = self.answers.get(task)
        if answer is not None and answer.given != given:
            raise self._differs(f"the window {task.window} has changed")
        if answer is not None and answer.weights != weights:
            raise self._differs(f"the weights of {task.method} have changed")
        return answer

    def _lines(self) -> list[dict[str, Any]]:
        """A killed process may leave a part of the last line: it is cut off."""
        if self.path is None or not self.path.is_file():
            return []
        content = self.path.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        if len(whole) < len(content):
            with self.path.open("rb+") as file:
                file.truncate(len(whole))
        try:
            return [json.loads(line) for line in whole.splitlines()]
        except ValueError as error:
            raise self._damaged() from error

    def _answers(self, lines: list[dict[str, Any]]) -> dict[Task, Answer]:
        try:
            answers = TypeAdapter(list[Answer]).validate_python(lines)
        except ValidationError as error:
            raise self._damaged() from error
        return {answer.task: answer for answer in answers}

    def _append(self, line: Mapping[str, Any]) -> None:
        if self.path is None:
            return
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def _differs(self, what: str) -> InputError:
        return InputError(
            "answers-differ",
            f"This run was begun otherwise: {what}.",
            where=str(self.path),
            fix="Delete that file to begin anew, or write the figures elsewhere.",
        )

    def _damaged(self) -> InputError:
        return InputError(
            "answers-damaged",
            "The answers of an earlier run cannot be read.",
            where=str(self.path),
            fix="Delete the file, or write the figures elsewhere.",
        )


@dataclass(frozen=True)
class FigureOrigin:
    """The clips, settings and networks that figures were made with."""

    sources: Sequence[str]
    windows: Sequence[str]
    """Names of the clips, or of the windows of them."""
    settings: Mapping[str, Any]
    networks: Mapping[str, Sequence[Header]]
    """Networks of each method."""
    skipped: Mapping[str, str]
    """Clips that could not be used, and why."""
    failed: Mapping[str, str]
    """Windows that a method could not answer, and why: left out for all."""


@dataclass(frozen=True)
class EvaluationRun:
    """The clips, an answer to each task about them, and where these come from."""

    clips: Sequence[RealClip]
    answers: Sequence[Answer]
    origin: FigureOrigin


Ask = Callable[[Truth, Task], MeasuredSamples]
"""Generates the people of a task, or takes the recorded ones, and measures them."""
Progress = Callable[[int, int], None]
"""(answers that are there, answers in all)."""


@dataclass(frozen=True)
class EvaluationRunner:
    """How tasks are asked, and where their answers are kept.

    Other processes call `read` and `load`, too, because to read clips and networks again is safer than to
    send them: with more than one worker these are functions of a module.
    """

    sources: Sequence[Path]
    read: Callable[[], Recorded]
    load: Callable[[], Ask]
    settings: Mapping[str, Any]
    """What every answer depends on; a file with answers of other settings is refused."""
    networks: Mapping[str, Sequence[Header]]
    """Networks of each method."""
    kept: Path | None = None
    """File of answers."""
    workers: int = 1
    """Processes; 1 asks in this one."""

    def run(self, asked: Sequence[tuple[str, bool]], progress: Progress) -> EvaluationRun:
        """Ask about every clip what has not been answered yet.

        Args:
            asked: methods, and whether the first frame is given.
            progress: called with how far it is.

        Raises:
            InputError: as `read`; ``answers-differ`` or ``answers-damaged``.
        """
        recorded = self.read()
        settings = {"measures": MEASURES, **self.settings}
        log = AnswerLog(self.kept, settings)
        given = {clip.name: _digest(clip) for clip in recorded.clips}
        weights = {method: digest_of(networks) for method, networks in self.networks.items()}
        tasks = [
            Task(method, clip.name, first) for clip in recorded.clips for method, first in asked
        ]
        missing = [t for t in tasks if not log.find(t, given[t.window], weights.get(t.method, ""))]
        progress(done := len(tasks) - len(missing), len(tasks))
        for task, figures in self._ask_all(missing, recorded.clips):
            weighed = weights.get(task.method, "")
            log.add(Answer(task, given[task.window], weighed, **figures))
            progress(done := done + 1, len(tasks))
        answers = [log.answers[task] for task in tasks]
        failed = {f"{a.task.method}, {a.task.window}": a.problem for a in answers if a.problem}
        sources, windows = [str(path) for path in self.sources], list(given)
        origin = FigureOrigin(sources, windows, settings, self.networks, recorded.skipped, failed)
        return EvaluationRun(recorded.clips, answers, origin)

    def _ask_all(
        self, tasks: Sequence[Task], clips: Sequence[RealClip]
    ) -> Iterator[tuple[Task, dict[str, Any]]]:
        """Yield each task with the fields of its answer, in the order in which they are ready."""
        if tasks and self.workers == 1:
            answerer = _Answerer(clips, self.load())
            yield from map(answerer.answer, tasks)
        elif tasks:
            with worker_pool(self.workers, _begin, self) as pool:
                for done in as_completed([pool.submit(_answer, task) for task in tasks]):
                    yield done.result()


class _Answerer:
    def __init__(self, clips: Sequence[RealClip], ask: Ask) -> None:
        self._ask = ask
        by_name = {clip.name: clip for clip in clips}
        self._truth = lru_cache(2)(lambda name: Truth(by_name[name]))

    def answer(self, task: Task) -> tuple[Task, dict[str, Any]]:
        try:
            return task, asdict(self._ask(self._truth(task.window), task))
        except OmocapError as problem:
            return task, {"problem": str(problem)}


_runner: list[EvaluationRunner] = []
"""In a worker process."""


def _begin(runner: EvaluationRunner) -> None:
    _runner[:] = [runner]
    # What compiled code still holds when Python ends is reported as leaked.
    atexit.register(_answerer.cache_clear)


@cache
def _answerer() -> _Answerer:
    """Read clips and networks once in a process, at the first task: their errors reach the caller then."""
    (runner,) = _runner
    return _Answerer(runner.read().clips, runner.load())


def _answer(task: Task) -> tuple[Task, dict[str, Any]]:
    return _answerer().answer(task)


def _digest(window: RealClip) -> str:
    """The same for the same person and object in the same motion."""
    digest = hashlib.sha256(str(len(window.root)).encode())
    mesh = window.motion.mesh
    poses = (window.motion.T_world_object, window.joints, window.rotations, mesh.vertices)
    for array in (*poses, mesh.faces):
        digest.update(np.ascontiguousarray(array, np.float32).tobytes())
    return digest.hexdigest()[:16]
