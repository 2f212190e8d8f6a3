"""From clips and weights to the tables, with verdicts on the orderings that the paper claims."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np

from capture_app.commands.tables import TablesRequest
from capture_app.tables.table_files import write_tables
from capture_app.tables.table_methods import METHODS, chosen_methods, load_methods, networks_of
from capture_app.tables.table_rows import Group, PaperTable, grouped, is_unseen, tables_of
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.learning.evaluation.clip_sources import (
    Recorded,
    check_sources,
    clip_of,
    read_recorded,
    windows_of,
)
from omomo_core.learning.evaluation.evaluated_methods import EvaluatedMethod
from omomo_core.learning.evaluation.evaluation_runner import (
    Answer,
    Ask,
    EvaluationRunner,
    FigureOrigin,
    Progress,
    Task,
)
from omomo_core.learning.evaluation.metrics import PairedDifference, paired_bootstrap
from omomo_core.learning.evaluation.real_clips import RealClip
from omomo_core.learning.evaluation.truth import MeasuredSamples, Truth
from omomo_core.learning.recordings.splits import side_of

F1, MPJPE = "contact_f1", "mpjpe_cm"
ORDER = ("omomo", "no-constraints", "single-stage", "goal")
"""From the best contact F1 to the worst, says the paper (section 5.2)."""
Of = Literal["best", "mean"]
"""Figure of the sample with the least MPJPE, as published; or of all samples, which chance touches less."""


def with_verdicts(table: PaperTable, answers: Sequence[Answer]) -> PaperTable:
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


ANSWERS = "answers.jsonl"
LoadMethods = Callable[[Sequence[str]], Mapping[str, EvaluatedMethod]]
"""Methods by the names of the command line; of a module, because other processes call it too."""


@dataclass(frozen=True)
class TablesRun:
    """The tables that were made, and their files."""

    tables: list[PaperTable]
    made: FigureOrigin
    files: list[Path]


def make_tables(
    request: TablesRequest, progress: Progress, load: LoadMethods | None = None
) -> TablesRun:
    """Ask, measure, and write; answers that an earlier run has kept are not asked again.

    Args:
        request: what to make.
        progress: called with how far it is.
        load: gives methods by name; from the request's weights, if not given.

    Raises:
        InputError: as `read_recorded`; ``no-windows``; ``unknown-method``; ``answers-differ``...
        AssetError: weights of a method are missing or damaged.
    """
    check_sources(request.clips)
    names = chosen_methods(request.methods, request.weights)
    load = load or partial(
        load_methods, weights=request.weights, sampler=request.sampler, steps=request.steps
    )
    runner = EvaluationRunner(
        request.clips,
        partial(_windows, request),
        partial(_asker, load, names, request.samples, request.seed),
        {key: getattr(request, key) for key in ("samples", "seed", "sampler", "steps")},
        {name: networks_of(name, request.weights) for name in names},
        request.output / ANSWERS,
        request.workers,
    )
    run = runner.run([(name, first) for name in names for first in request.first_frames], progress)
    tables = [
        with_verdicts(table, run.answers) for table in tables_of(run.answers, request.samples)
    ]
    settings = {**run.origin.settings, "split": request.split or ""}
    made = replace(run.origin, settings=settings)
    return TablesRun(tables, made, write_tables(request.output, tables, made))


def _asker(load: LoadMethods, names: Sequence[str], samples: int, seed: int) -> Ask:
    methods = load(names)

    def ask(truth: Truth, task: Task) -> MeasuredSamples:
        # Another seed in every window: guesses must not all err alike.
        drawn = np.random.SeedSequence([seed, zlib.crc32(task.window.encode())])
        own = int(drawn.generate_state(1)[0])
        method = methods[task.method]
        people = method.sample(truth.clip, samples, own, first_frame=task.first_frame)
        return truth.answer(people, 0, truth.clip.body)

    return ask


def _windows(request: TablesRequest) -> Recorded:
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
    return Recorded([w for kind in kinds for w in _spread(kind, request.limit)], skipped)


def _spread(windows: list[RealClip], limit: int | None) -> list[RealClip]:
    """So many windows, evenly spread."""
    if limit is None or len(windows) <= limit:
        return windows
    chosen = np.linspace(0, len(windows) - 1, limit).round().astype(int)
    return [windows[k] for k in chosen]
