"""From answers to tables: sections of rows, beside those of the paper's tables 2, 3 and 4."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from capture_app.tables.table_methods import METHODS
from omomo_core.learning.evaluation.clip_sources import clip_of
from omomo_core.learning.evaluation.evaluation_runner import Answer
from omomo_core.learning.evaluation.metrics import average
from omomo_core.learning.recordings.splits import UNSEEN, cast_of


@dataclass(frozen=True)
class Column:
    """A figure in a table."""

    key: str
    """Key of a row of figures (`omomo_core.learning.evaluation`)."""
    title: str
    latex: str


PUBLISHED = (
    Column("hand_jpe_cm", "HandJPE", "HandJPE"),
    Column("mpjpe_cm", "MPJPE", "MPJPE"),
    Column("mpvpe_cm", "MPVPE", "MPVPE"),
    Column("t_root_cm", "T_root", r"$T_{root}$"),
    Column("o_root", "O_root", r"$O_{root}$"),
    Column("collision_share_published", "Coll.", "Coll."),
    Column("foot_sliding_cm", "FS", "FS"),
    Column("contact_precision", "C_prec", r"$C_{prec}$"),
    Column("contact_recall", "C_rec", r"$C_{rec}$"),
    Column("contact_f1", "F1", "F1"),
)
"""Columns by the published evaluation's formulas. Its scans have thousands of vertices; lest meshes of few
large faces have no surface, points between the vertices count as vertices."""
CORRECTED = (
    Column("left_hand_jpe_cm", "Left hand", "Left hand"),
    Column("right_hand_jpe_cm", "Right hand", "Right hand"),
    Column("o_root_deg", "O_root deg", r"$O_{root}$ deg"),
    Column("collision_share", "Coll. 4 cm", "Coll.\\ 4 cm"),
    Column("penetration_cm", "Depth cm", "Depth cm"),
    Column("toe_skating_cm_s", "Toes cm/s", "Toes cm/s"),
    Column("hand_contact_precision", "C_prec", r"$C_{prec}$"),
    Column("hand_contact_recall", "C_rec", r"$C_{rec}$"),
    Column("hand_contact_f1", "F1", "F1"),
    Column("contact_f1_where_held", "F1 some hand", "F1 some hand"),
    Column("published_contact_f1", "F1 vertices", "F1 vertices"),
)
"""True centimetres and degrees; contact of each hand, and of some hand, without windows in which nobody
touches; and as published to the letter, from the mesh's own vertices."""
ABLATION = tuple(PUBLISHED[k] for k in (1, 3, 7, 8, 9))
"""Columns of table 4."""

_KEYS = [column.key for column in PUBLISHED]


def _row(*values: float) -> dict[str, float]:
    return dict(zip(_KEYS, values, strict=True))


def _ablation(*values: float) -> dict[str, float]:
    return dict(zip([column.key for column in ABLATION], values, strict=True))


PAPER: dict[str, dict[str, dict[str, float]]] = {
    "seen": {
        "goal": _row(49.90, 15.64, 21.82, 34.35, 0.76, 0.12, 0.18, 0.83, 0.23, 0.32),
        "single-stage": _row(26.60, 12.07, 16.13, 17.93, 0.47, 0.19, 0.38, 0.78, 0.42, 0.51),
        "no-constraints": _row(24.79, 12.55, 16.66, 18.62, 0.51, 0.21, 0.36, 0.83, 0.58, 0.64),
        "omomo": _row(24.01, 12.42, 16.67, 18.44, 0.50, 0.22, 0.38, 0.82, 0.70, 0.72),
        "gt-hands": _ablation(7.01, 10.08, 0.89, 0.77, 0.79),
    },
    "unseen": {
        "goal": _row(53.97, 15.27, 20.92, 40.53, 0.78, 0.06, 0.18, 0.79, 0.21, 0.29),
        "single-stage": _row(26.06, 12.33, 16.67, 19.49, 0.51, 0.15, 0.43, 0.72, 0.40, 0.47),
        "no-constraints": _row(26.15, 13.25, 17.77, 21.55, 0.53, 0.16, 0.45, 0.76, 0.44, 0.52),
        "omomo": _row(25.12, 13.06, 17.60, 21.19, 0.53, 0.17, 0.43, 0.74, 0.58, 0.61),
        "gt-hands": _ablation(7.73, 11.08, 0.80, 0.64, 0.67),
    },
}
"""Best of 20 by MPJPE, the person's first frame given; table 2 has all 15 objects, table 3 five."""


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
    """Values by the keys of the columns; some may be missing."""
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
    """Columns of the same rows again, without what is odd in the published measures."""
    sections: list[Section]
    verdicts: list[str] = field(default_factory=list)
    """Whether what the paper claims holds here, in words."""


Group = Mapping[str, Mapping[str, Answer]]
"""Answers of one protocol and one kind of objects: by method, then by window."""


def is_unseen(window: str) -> bool:
    """Whether a window's object is one of the paper's five unseen ones, by its name."""
    cast = cast_of(clip_of(window))
    return cast is not None and cast.object in UNSEEN


def grouped(answers: Sequence[Answer], *, unseen: bool, first_frame: bool) -> Group:
    """The answers of one protocol, on the windows that all its methods could answer."""
    group: dict[str, dict[str, Answer]] = {}
    for row in answers:
        if row.task.first_frame is first_frame and is_unseen(row.task.window) is unseen:
            group.setdefault(row.task.method, {})[row.task.window] = row
    failed = {w for rows in group.values() for w, row in rows.items() if row.problem}
    asked = [set(rows) for rows in group.values()]
    common = sorted(set[str].intersection(*asked) - failed) if asked else []
    return {name: {w: group[name][w] for w in common} for name in METHODS if name in group}


def tables_of(answers: Sequence[Answer], samples: int) -> list[PaperTable]:
    """Tables 2, 3 and 4, as far as there are windows for them."""
    tables: list[PaperTable] = []
    for number, unseen in ((2, False), (3, True)):
        sections = _sections(answers, samples, (unseen,), tuple(METHODS))
        tables.append(PaperTable(number, TITLES[number], PUBLISHED, CORRECTED, sections))
    ablation = _sections(answers, samples, (False, True), _ABLATED)
    if any(METHODS["gt-hands"].title in line.label for s in ablation for line in s.lines):
        tables.append(PaperTable(4, TITLES[4], ABLATION, CORRECTED, ablation))
    return [table for table in tables if table.sections]


def _sections(
    answers: Sequence[Answer], samples: int, kinds: Sequence[bool], names: Sequence[str]
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
    rows: Mapping[str, Answer],
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
