"""From clips and weights to the tables, with verdicts on the orderings that the paper claims."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from capture_app.commands.spelling import in_options
from capture_app.commands.tables import TablesRequest
from capture_app.tables.answers import Load, Questions, ResultLog, Task, WindowResult, ask_all
from capture_app.tables.table_files import TableOrigin, write_tables
from capture_app.tables.table_methods import (
    METHODS,
    chosen_methods,
    digest_of,
    load_methods,
    networks_of,
)
from capture_app.tables.table_rows import Group, PaperTable, grouped, is_unseen, tables_of
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.evaluation.clip_sources import (
    check_sources,
    clip_of,
    read_recorded,
    windows_of,
)
from omomo_core.learning.evaluation.metrics import PairedDifference, paired_bootstrap
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.recordings.splits import side_of

F1, MPJPE = "contact_f1", "mpjpe_cm"
ORDER = ("omomo", "no-constraints", "single-stage", "goal")
"""From the best contact F1 to the worst, says the paper (section 5.2)."""
Of = Literal["best", "mean"]
"""Figure of the sample with the least MPJPE, as published; or of all samples, which chance touches less."""


def with_verdicts(table: PaperTable, answers: Sequence[WindowResult]) -> PaperTable:
    """The table with a sentence for each claim of the paper that can be looked at."""
    verdicts: list[str] = []
    frames = sorted({section.first_frame for section in table.sections}, reverse=True)
    for unseen in {2: [False], 3: [True], 4: [False, True]}[table.number]:
        groups = {frame: grouped(answers, unseen=unseen, first_frame=frame) for frame in frames}
        # The paper's own protocol, or what comes nearest to it.
        group = groups[frames[0]]
        if table.number == 4:
            verdicts += _ablation(group, unseen)
            continue
        verdicts += _ordering(group, "best", "")
        for frame in frames:
            given = "given" if frame else "not given"
            where = f", in the mean of all samples, first frame {given}"
            verdicts += _ordering(groups[frame], "mean", where)
    return replace(table, verdicts=verdicts)


def _ordering(group: Group, of: Of, where: str) -> list[str]:
    there = [name for name in ORDER if name in group]
    pairs = list(pairwise(there))
    differences = [_compared(group, a, b, F1, of) for a, b in pairs]
    if not differences:
        return []
    claim = " > ".join(METHODS[name].title for name in there)
    wrong = sum(difference.mean <= 0 for difference in differences)
    unsure = sum(difference.low <= 0 < difference.mean for difference in differences)
    if wrong:
        outcome = f"does not hold: {wrong} of {len(differences)} steps do not go this way"
    elif unsure:
        outcome = f"is what the means say, but {unsure} of {len(differences)} steps may be chance"
    else:
        outcome = "holds in every step"
    if len(there) > 2:
        # Steps may each be small where the whole way is not.
        pairs.append((there[0], there[-1]))
        differences.append(_compared(group, *pairs[-1], F1, of))
    details = [
        _told(a, b, "F1", difference, 2)
        for (a, b), difference in zip(pairs, differences, strict=True)
    ]
    return [f"The paper's ordering by contact F1, {claim}{where}, {outcome}.", *details]


def _ablation(group: Group, unseen: bool) -> list[str]:
    if not {"omomo", "gt-hands"} <= group.keys():
        return []
    where = " on unseen objects" if unseen else ""
    better = _compared(group, "gt-hands", "omomo", F1, "best")
    nearer = _compared(group, "omomo", "gt-hands", MPJPE, "best")
    holds = "holds" if min(better.low, nearer.low) > 0 else "is not certain"
    if better.mean <= 0 or nearer.mean <= 0:
        holds = "does not hold"
    return [
        f"The paper's claim that true palms give better people{where} {holds}.",
        _told("gt-hands", "omomo", "F1", better, 2),
        _told("omomo", "gt-hands", "MPJPE", nearer, 1),
    ]


def _compared(group: Group, first: str, second: str, key: str, of: Of) -> PairedDifference:
    """Return the difference of a figure of the best of K, or of all samples, between two methods."""
    windows = list(group[first])

    def values(method: str) -> list[float]:
        return [getattr(group[method][window], of)[key] for window in windows]

    return paired_bootstrap(values(first), values(second), [clip_of(window) for window in windows])


def _told(first: str, second: str, figure: str, difference: PairedDifference, digits: int) -> str:
    sign = "surely" if difference.low > 0 or difference.high < 0 else "perhaps by chance"
    return (
        f"{figure} of {METHODS[first].title} minus that of {METHODS[second].title}: "
        f"{difference.mean:+.{digits}f} (95 % of the draws of whole clips from {difference.low:+.{digits}f} "
        f"to {difference.high:+.{digits}f}; {sign})."
    )


MEASURES = 1
"""Raised whenever the same people would be measured otherwise."""
Progress = Callable[[int, int], None]
"""(answers that are there, answers in all)."""


@dataclass(frozen=True)
class TablesRun:
    """The tables that were made, and their files."""

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
    asked = ask_all(questions, missing, request.workers) if missing else ()
    for done, (task, answer) in enumerate(asked, start=len(tasks) - len(missing) + 1):
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
            skipped[clip.name] = in_options(str(problem))
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
    digest = hashlib.sha256(str(len(window.root)).encode())
    mesh = window.motion.mesh
    poses = (window.motion.T_world_object, window.joints, window.rotations, mesh.vertices)
    for array in (*poses, mesh.faces):
        digest.update(np.ascontiguousarray(array, np.float32).tobytes())
    return digest.hexdigest()[:16]
