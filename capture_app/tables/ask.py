"""Asking methods about windows, in this process or in several."""

import zlib
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from capture_app.tables.answers import Task
from omomo_core.compute import worker_pool
from omomo_core.errors import OmocapError
from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.learning.evaluation.methods import EvaluatedMethod
from omomo_core.learning.evaluation.truth import MeasuredSamples, Truth

Load = Callable[[Sequence[str]], Mapping[str, EvaluatedMethod]]
"""Methods by the names of the command line; must be of a module, for other processes call it too."""
Read = Callable[[], Sequence[RealClip]]
"""The windows; of a module, too: to read them again is safer than to send them."""
Answered = tuple[Task, MeasuredSamples | str]
"""An answer, or why there is none."""


@dataclass(frozen=True)
class Questions:
    """What every question shares."""

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
            return task, str(problem)
        return task, truth.answer(people, 0, truth.clip.body)


_asker: list[Any] = []
"""In a worker process; methods and windows are read once, not for every question."""


def _begin(questions: Questions) -> None:
    _asker[:] = [_Asker(questions)]


def _ask(task: Task) -> Answered:
    return _asker[0].ask(task)
