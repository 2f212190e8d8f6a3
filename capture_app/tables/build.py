"""From answers to tables: sections of rows, each with the paper's own numbers beneath ours."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from capture_app.tables.answers import WindowResult
from capture_app.tables.methods import METHODS
from capture_app.tables.paper import ABLATION, CORRECTED, PAPER, PUBLISHED, Column
from omomo_core.learning.evaluation.metrics import average
from omomo_core.learning.evaluation.sources import clip_of
from omomo_core.learning.recordings.splits import UNSEEN, cast_of

TITLES = {
    2: "People moving objects of the paper's training split",
    3: "People moving the paper's unseen objects",
    4: "Ablation: palms predicted and true (* unseen objects)",
}
_ABLATED = ("omomo", "gt-hands", "capture")


@dataclass(frozen=True)
class TableRow:
    """One row of a table."""

    label: str
    values: Mapping[str, float]
    """By the keys of the columns; some may be missing."""
    published: bool = False
    """Whether these are the paper's own numbers."""


@dataclass(frozen=True)
class Section:
    """Rows of one protocol."""

    title: str
    first_frame: bool
    best: bool
    """The best of K, or one sample."""
    lines: list[TableRow]
    windows: int
    clips: int


@dataclass(frozen=True)
class PaperTable:
    """One of the paper's tables."""

    number: int
    title: str
    columns: Sequence[Column]
    corrected: Sequence[Column]
    """Of the same rows again, without what is odd in the published measures."""
    sections: list[Section]
    verdicts: list[str] = field(default_factory=list)
    """Whether what the paper claims holds here, in words."""


Group = Mapping[str, Mapping[str, WindowResult]]
"""Answers of one protocol and one kind of objects: by method, then by window."""


def is_unseen(window: str) -> bool:
    """Whether a window's object is one of the paper's five unseen ones, by its name."""
    cast = cast_of(clip_of(window))
    return cast is not None and cast.object in UNSEEN


def grouped(answers: Sequence[WindowResult], *, unseen: bool, first_frame: bool) -> Group:
    """The answers of one protocol, on the windows that all its methods could answer."""
    group: dict[str, dict[str, WindowResult]] = {}
    for row in answers:
        if row.task.first_frame is first_frame and is_unseen(row.task.window) is unseen:
            group.setdefault(row.task.method, {})[row.task.window] = row
    failed = {w for rows in group.values() for w, row in rows.items() if row.problem}
    asked = [set(rows) for rows in group.values()]
    common = sorted(set[str].intersection(*asked) - failed) if asked else []
    return {name: {w: group[name][w] for w in common} for name in METHODS if name in group}


def tables_of(answers: Sequence[WindowResult], samples: int) -> list[PaperTable]:
    """Tables 2, 3 and 4, as far as there are windows for them."""
    found: list[PaperTable] = []
    for number, unseen in ((2, False), (3, True)):
        sections = _sections(answers, samples, (unseen,), tuple(METHODS))
        found.append(PaperTable(number, TITLES[number], PUBLISHED, CORRECTED, sections))
    ablation = _sections(answers, samples, (False, True), _ABLATED)
    if any(METHODS["gt-hands"].title in line.label for s in ablation for line in s.lines):
        found.append(PaperTable(4, TITLES[4], ABLATION, CORRECTED, ablation))
    return [table for table in found if table.sections]


def _sections(
    answers: Sequence[WindowResult], samples: int, kinds: Sequence[bool], names: Sequence[str]
) -> list[Section]:
    sections: list[Section] = []
    for first_frame in (True, False):
        groups = {
            unseen: grouped(answers, unseen=unseen, first_frame=first_frame) for unseen in kinds
        }
        windows = [w for group in groups.values() for w in next(iter(group.values()), {})]
        if not windows:
            continue
        for best in (True, False):
            lines = [
                line
                for unseen, group in groups.items()
                for name in names
                if group.get(name)
                for line in _lines(name, group[name], unseen, best, first_frame, len(kinds) > 1)
            ]
            title = f"first frame {'given' if first_frame else 'not given'}, " + (
                f"best of {samples}" if best else "one sample"
            )
            clips = len({clip_of(window) for window in windows})
            sections.append(Section(title, first_frame, best, lines, len(windows), clips))
    return sections


def _lines(
    name: str,
    rows: Mapping[str, WindowResult],
    unseen: bool,
    best: bool,
    first_frame: bool,
    starred: bool,
) -> list[TableRow]:
    """A method's line, and the paper's where it says something of this protocol."""
    label = METHODS[name].title + ("*" if unseen and starred else "")
    ours = TableRow(label, average([row.best if best else row.one for row in rows.values()]))
    paper = PAPER["unseen" if unseen else "seen"].get(name)
    if paper is None or not (best and first_frame):
        return [ours]
    return [ours, TableRow(f"{label}, paper", paper, published=True)]
