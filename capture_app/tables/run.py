"""The whole way from clips and weights to the tables."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from capture_app.commands.tables import TablesRequest
from capture_app.tables.answers import ResultLog, Task, WindowResult
from capture_app.tables.ask import Load, Questions, ask_all
from capture_app.tables.build import PaperTable, is_unseen, tables_of
from capture_app.tables.caption import TableOrigin
from capture_app.tables.methods import chosen_methods, digest_of, load_methods, networks_of
from capture_app.tables.verdict import with_verdicts
from capture_app.tables.write import write_tables
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.learning.evaluation.sources import check_sources, read_recorded, windows_of
from omomo_core.learning.recordings.splits import side_of

MEASURES = 1
"""Raised whenever the same people would be measured otherwise."""
Progress = Callable[[int, int], None]
"""(answers that are there, answers in all)."""


@dataclass(frozen=True)
class TablesRun:
    """What was made."""

    tables: list[PaperTable]
    made: TableOrigin
    files: list[Path]


def make_tables(request: TablesRequest, progress: Progress, load: Load | None = None) -> TablesRun:
    """Ask, measure, and write; answers that an earlier run has kept are not asked again.

    Args:
        request: what to make.
        progress: called with how far it is.
        load: gives methods by name; from the request's weights, if not given.

    Raises:
        InputError: as `read_recorded`; ``no-windows``; ``unknown-method``; ``tables-differ``...
        AssetError: weights of a method are missing or damaged.
    """
    check_sources(request.clips)
    names = chosen_methods(request.methods, request.weights)
    networks = {name: networks_of(name, request.weights) for name in names}
    windows, skipped = _windows(request)
    answers = ResultLog(request.output, _settings(request))
    load = load or partial(
        load_methods, weights=request.weights, sampler=request.sampler, steps=request.steps
    )
    read = (lambda: windows) if request.workers == 1 else partial(_read, request)
    questions = Questions(load, names, read, request.samples, request.seed)
    digests = {name: digest_of(networks[name]) for name in names}
    rows = _answered(questions, windows, answers, request, digests, progress)
    tables = [with_verdicts(table, rows) for table in tables_of(rows, request.samples)]
    made = TableOrigin(
        [str(path) for path in request.clips],
        request.split or "",
        [window.name for window in windows],
        request.samples,
        request.seed,
        request.sampler,
        request.steps,
        networks,
        skipped,
        {f"{r.task.method}, {r.task.window}": r.problem for r in rows if r.problem},
    )
    return TablesRun(tables, made, write_tables(request.output, tables, made))


def _answered(
    questions: Questions,
    windows: Sequence[RealClip],
    answers: ResultLog,
    request: TablesRequest,
    weights: dict[str, str],
    progress: Progress,
) -> list[WindowResult]:
    """Every answer, those that were not there asked for."""
    given = {window.name: _digest(window) for window in windows}
    tasks = [
        Task(method, window.name, first_frame)
        for window in windows
        for method in questions.methods
        for first_frame in request.first_frames
    ]
    missing = [t for t in tasks if not answers.find(t, given[t.window], weights[t.method])]
    progress(len(tasks) - len(missing), len(tasks))
    found = ask_all(questions, missing, request.workers) if missing else ()
    for done, (task, answer) in enumerate(found, start=len(tasks) - len(missing) + 1):
        figures: dict[str, Any] = {"problem": answer} if isinstance(answer, str) else asdict(answer)
        answers.add(WindowResult(task, given[task.window], weights[task.method], **figures))
        progress(done, len(tasks))
    return [answers.rows[task] for task in tasks]


def _read(request: TablesRequest) -> list[RealClip]:
    return _windows(request)[0]


def _windows(request: TablesRequest) -> tuple[list[RealClip], dict[str, str]]:
    recorded = read_recorded(request.clips, load_body())
    skipped, windows = dict(recorded.skipped), list[RealClip]()
    for clip in recorded.clips:
        if request.split and side_of(clip.name) != request.split:
            skipped[clip.name] = f"It is not on the side {request.split!r} of the split."
            continue
        try:
            windows += windows_of(clip)
        except InputError as problem:
            skipped[clip.name] = str(problem)
    if not windows:
        raise InputError(
            "no-windows",
            f"No clip gives a window. {next(iter(skipped.values()))}",
            where=", ".join(str(path) for path in request.clips),
            fix="Give clips of 30 frames or more, of people and objects of the split.",
        )
    kinds = [[w for w in windows if is_unseen(w.name) is unseen] for unseen in (False, True)]
    return [w for kind in kinds for w in _spread(kind, request.limit)], skipped


def _spread(windows: list[RealClip], limit: int | None) -> list[RealClip]:
    """So many windows, evenly spread."""
    if limit is None or len(windows) <= limit:
        return windows
    chosen = np.linspace(0, len(windows) - 1, limit).round().astype(int)
    return [windows[k] for k in chosen]


def _settings(request: TablesRequest) -> dict[str, object]:
    return {
        "measures": MEASURES,
        "samples": request.samples,
        "seed": request.seed,
        "sampler": request.sampler,
        "steps": request.steps,
    }


def _digest(window: RealClip) -> str:
    """The same for the same person and object in the same motion."""
    seen = hashlib.sha256(str(len(window.root)).encode())
    mesh = window.motion.mesh
    poses = (window.motion.T_world_object, window.joints, window.rotations, mesh.vertices)
    for array in (*poses, mesh.faces):
        seen.update(np.ascontiguousarray(array, np.float32).tobytes())
    return seen.hexdigest()[:16]
