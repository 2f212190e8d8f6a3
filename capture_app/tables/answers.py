"""Answers of methods about windows, measured, and kept line by line so that a run can be resumed."""

import json
import os
import zlib
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from capture_app.commands.spelling import in_options
from omomo_core.compute import worker_pool
from omomo_core.errors import InputError, OmocapError
from omomo_core.learning.evaluation.evaluated_methods import EvaluatedMethod
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.evaluation.truth import MeasuredSamples, Truth

FILE = "answers.jsonl"


@dataclass(frozen=True)
class Task:
    """One question: a method, a window, and whether the person's first frame is given."""

    method: str
    window: str
    first_frame: bool


@dataclass(frozen=True)
class WindowResult:
    """A method's K people for one window, measured; or why it could make none."""

    task: Task
    given: str
    """Digest of the window."""
    weights: str
    """Digest of the method's networks."""
    one: dict[str, float] = field(default_factory=dict)
    """The sample that the method would show."""
    best: dict[str, float] = field(default_factory=dict)
    """That with the least MPJPE."""
    mean: dict[str, float] = field(default_factory=dict)
    """Mean of all samples, without what needs their surface."""
    problem: str = ""


class ResultLog:
    """The file of answers in the folder of the tables: a line of settings, then one an answer."""

    def __init__(self, folder: Path, settings: Mapping[str, Any]) -> None:
        """Open the file, or begin it.

        Args:
            folder: of the tables; made if it is not there.
            settings: what every answer depends on.

        Raises:
            InputError: ``tables-differ`` or ``tables-damaged``.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / FILE
        lines = self._lines()
        if not lines:
            self._append(settings)
            lines = [dict(settings)]
        before = lines[0]
        changed = [k for k in {**before, **settings} if before.get(k) != settings.get(k)]
        if changed:
            changes = ", ".join(f"{k} was {before.get(k)}, now {settings.get(k)}" for k in changed)
            raise self._differs(changes)
        self.rows = self._rows(lines[1:])

    def add(self, row: WindowResult) -> None:
        """Keep an answer; it is on the disk when this returns."""
        self.rows[row.task] = row
        self._append(asdict(row))

    def find(self, task: Task, given: str, weights: str) -> WindowResult | None:
        """Return what is kept for a question.

        Raises:
            InputError: ``tables-differ`` when the window or the weights are not what they were.
        """
        row = self.rows.get(task)
        if row is not None and row.given != given:
            raise self._differs(f"the window {task.window} has changed")
        if row is not None and row.weights != weights:
            raise self._differs(f"the weights of {task.method} have changed")
        return row

    def _lines(self) -> list[dict[str, Any]]:
        """A killed process may leave a part of the last line: it is cut off."""
        if not self.path.is_file():
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

    def _rows(self, lines: list[dict[str, Any]]) -> dict[Task, WindowResult]:
        try:
            rows = TypeAdapter(list[WindowResult]).validate_python(lines)
        except ValidationError as error:
            raise self._damaged() from error
        return {row.task: row for row in rows}

    def _append(self, line: Mapping[str, Any]) -> None:
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
            file.flush()
            os.fsync(file.fileno())

    def _differs(self, what: str) -> InputError:
        return InputError(
            "tables-differ",
            f"These tables were begun otherwise: {what}.",
            where=str(self.path),
            fix="Give another folder with ‹output›, or delete that file to begin anew.",
        )

    def _damaged(self) -> InputError:
        return InputError(
            "tables-damaged",
            "The answers of an earlier run cannot be read.",
            where=str(self.path),
            fix="Delete the file, or give another folder with ‹output›.",
        )


Load = Callable[[Sequence[str]], Mapping[str, EvaluatedMethod]]
"""Methods by the names of the command line; must be of a module, for other processes call it too."""
Read = Callable[[], Sequence[RealClip]]
"""The windows; of a module, too: to read them again is safer than to send them."""
Answered = tuple[Task, MeasuredSamples | str]
"""An answer, or why there is none."""


@dataclass(frozen=True)
class Questions:
    """The settings that all questions share."""

    load: Load
    methods: Sequence[str]
    read: Read
    samples: int
    seed: int


def ask_all(questions: Questions, tasks: Sequence[Task], workers: int) -> Generator[Answered]:
    """Answers in the order in which they are ready.

    Args:
        questions: methods and windows.
        tasks: what to ask; those of one window together are faster.
        workers: processes; 1 asks in this one.
    """
    if workers == 1:
        asker = _Asker(questions)
        yield from map(asker.ask, tasks)
        return
    with worker_pool(workers, _begin, questions) as pool:
        for done in as_completed([pool.submit(_ask, task) for task in tasks]):
            yield done.result()


class _Asker:
    def __init__(self, questions: Questions) -> None:
        self._questions = questions
        self._methods = questions.load(questions.methods)
        windows = {window.name: window for window in questions.read()}
        self._truth = lru_cache(2)(lambda name: Truth(windows[name]))

    def ask(self, task: Task) -> Answered:
        truth, samples = self._truth(task.window), self._questions.samples
        # Another seed in every window: guesses must not all err alike.
        drawn = np.random.SeedSequence([self._questions.seed, zlib.crc32(task.window.encode())])
        seed = int(drawn.generate_state(1)[0])
        try:
            people = self._methods[task.method].sample(
                truth.clip, samples, seed, first_frame=task.first_frame
            )
        except OmocapError as problem:
            return task, in_options(str(problem))
        return task, truth.answer(people, 0, truth.clip.body)


_asker: list[Any] = []
"""In a worker process; methods and windows are read once, not for every question."""


def _begin(questions: Questions) -> None:
    _asker[:] = [_Asker(questions)]


def _ask(task: Task) -> Answered:
    return _asker[0].ask(task)
