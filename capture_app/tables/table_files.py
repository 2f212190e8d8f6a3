"""The tables as Markdown, LaTeX and JSON files, with their captions."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from capture_app.commands.spelling import all_in_options, in_options
from capture_app.tables.table_rows import Column, PaperTable
from omomo_core.learning.evaluation.clip_sources import clip_of
from omomo_core.learning.evaluation.evaluation_runner import FigureOrigin
from omomo_core.learning.recordings.splits import cast_of
from omomo_core.stages.network_file import Header
from omomo_core.whole_file import write_whole


@dataclass(frozen=True)
class Row:
    """A heading of rows below it, or a label and its cells."""

    label: str
    cells: tuple[str, ...] = ()
    """Empty for a heading."""
    published: bool = False
    """The paper's own numbers."""


@dataclass(frozen=True)
class Sheet:
    """Columns and rows."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]

    def sections(self) -> list[tuple[str, list[Row]]]:
        """Each heading with the rows below it."""
        sections: list[tuple[str, list[Row]]] = []
        for row in self.rows:
            if row.cells:
                sections[-1][1].append(row)
            else:
                sections.append((row.label, []))
        return sections


def sheets_of(table: PaperTable) -> tuple[Sheet, Sheet]:
    """The table as published with the paper's numbers, and ours again without the oddities."""
    name = f"Table {table.number}. {table.title}"
    published, corrected = tuple(table.columns), tuple(table.corrected)
    return (
        Sheet(name, published, tuple(_rows(table, published, with_paper=True))),
        Sheet(
            f"Table {table.number}, the same people in true units and by each hand",
            corrected,
            tuple(_rows(table, corrected, with_paper=False)),
        ),
    )


def _rows(table: PaperTable, columns: tuple[Column, ...], *, with_paper: bool) -> Iterator[Row]:
    for section in table.sections:
        yield Row(f"{section.title} (windows: {section.windows}, clips: {section.clips})")
        for line in section.lines:
            if with_paper or not line.published:
                cells = tuple(_cell(line.values.get(column.key)) for column in columns)
                yield Row(line.label, cells, line.published)


def _cell(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"


_BUDGET = {
    "size": "size {}",
    "steps_done": "{} steps",
    "batch": "of {} windows",
    "seed": "seed {}",
    "cpu_seconds": "{} s of processor time",
}
"""Notes in a network's file that tell its budget."""


def caption(made: FigureOrigin) -> list[str]:
    """Sentences, for all tables together."""
    return [_data(made), _protocol(made), *_weights(made), *_left_out(made)]


def _data(made: FigureOrigin) -> str:
    clips = {clip_of(window) for window in made.windows}
    casts = [cast for clip in clips if (cast := cast_of(clip)) is not None]
    people = sorted({cast.person for cast in casts})
    things = sorted({cast.object for cast in casts})
    who = f"; people {', '.join(f'sub{p}' for p in people)}; {', '.join(things)}" if casts else ""
    split = f" (split {made.settings['split']})" if made.settings["split"] else ""
    return (
        f"Data: {', '.join(made.sources)}{split}: {len(made.windows)} windows of up to 120 frames "
        f"from {len(clips)} clips{who}. These are not the paper's test clips: its numbers are of "
        f"other data."
    )


def _protocol(made: FigureOrigin) -> str:
    settings = made.settings
    walk = "all 1,000 steps" if settings["sampler"] == "ddpm" else f"{settings['steps']} steps"
    return (
        f"Best of {settings['samples']}: the sample with the least MPJPE, every figure of it, as published. "
        f"One sample: the one that the method shows. Sampler {settings['sampler']}, {walk}; "
        f"seed {settings['seed']}. "
        f"Centimetres; O_root, Coll. (share of frames) and contact scores have no unit. Coll. is by the "
        f"published code, whose threshold is 4 % of half the object's largest side; the second of each "
        f"two tables has true 4 cm. A palm touches within 5 cm of the object: of its vertices and points "
        f"between them, for scans have many vertices and models few (F1 vertices: of its vertices alone)."
    )


def _weights(made: FigureOrigin) -> list[str]:
    networks = {n.name: n for group in made.networks.values() for n in group}
    descriptions = [_network(network) for network in networks.values()]
    return [f"Weights: {'; '.join(descriptions)}."] if descriptions else []


def _network(network: Header) -> str:
    notes = [text.format(network.notes[k]) for k, text in _BUDGET.items() if k in network.notes]
    if start := network.notes.get("started_from"):
        notes.append(f"from the weights {start}")
    size = f"{network.parameters / 1e6:.1f} M numbers"
    if (held := network.notes.get("clips_held_out", "0")) != "0":
        notes.append(f"trained on {held} clips of held-out people, too")
    return f"{network.name} {network.digest} ({', '.join([size, *notes])})"


def _left_out(made: FigureOrigin) -> list[str]:
    out: list[str] = []
    if made.failed:
        names = ", ".join(f"{task} ({in_options(why)})" for task, why in made.failed.items())
        out.append(f"Left out for all methods, because one had no answer: {names}.")
    if made.skipped:
        out.append(f"{len(made.skipped)} clips could not be used, or are of another split.")
    return out


MARKDOWN, LATEX, JSON = "tables.md", "tables.tex", "tables.json"
_ESCAPED = {
    "\\": r"\textbackslash{}",
    **{c: f"\\{c}" for c in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


def write_tables(folder: Path, tables: Sequence[PaperTable], made: FigureOrigin) -> list[Path]:
    """Write `tables.md`, `tables.tex` and `tables.json` into a folder.

    Raises:
        InputError: as `write_whole`.
    """
    texts = {
        MARKDOWN: markdown(tables, made),
        LATEX: latex(tables, made),
        JSON: figures_json(_document(tables, made), made),
    }
    for name, text in texts.items():
        write_whole(folder / name, text)
    return [folder / name for name in texts]


def figures_json(figures: Mapping[str, Any], made: FigureOrigin) -> str:
    """Figures as JSON, with where they come from."""
    return json.dumps(all_in_options({**figures, "made": asdict(made)}), indent=1) + "\n"


def markdown(tables: Sequence[PaperTable], made: FigureOrigin) -> str:
    """One part of a page: a heading and two tables for each, verdicts, and the caption."""
    parts: list[str] = []
    for table in tables:
        published, corrected = sheets_of(table)
        parts += [f"### {published.title}", _markdown_grid(published)]
        if table.verdicts:
            parts.append("\n".join(f"- {verdict}" for verdict in table.verdicts))
        parts += [f"{corrected.title}:", _markdown_grid(corrected)]
    parts.append("### How these tables were made")
    return "\n\n".join([*parts, *caption(made)]) + "\n"


def _markdown_grid(sheet: Sheet) -> str:
    lines = ["| " + " | ".join(["", *(c.title for c in sheet.columns)]) + " |"]
    lines.append("|---" + "|--:" * len(sheet.columns) + "|")
    for row in sheet.rows:
        mark = "*" if row.published else "" if row.cells else "**"
        cells = row.cells or ("",) * len(sheet.columns)
        # A star of a label is not the beginning of an emphasis.
        label = mark + row.label.replace("*", r"\*") + mark
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def latex(tables: Sequence[PaperTable], made: FigureOrigin) -> str:
    """A float for each table; needs no packages."""
    caption_text = " ".join(caption(made))
    floats: list[str] = []
    for table in tables:
        for sheet, text in zip(
            sheets_of(table), (" ".join([*table.verdicts, caption_text]), ""), strict=True
        ):
            floats.append(_latex_float(sheet, text))
    return "\n\n".join(floats) + "\n"


def _latex_float(sheet: Sheet, text: str) -> str:
    head = " & ".join(["Method", *(column.latex for column in sheet.columns)])
    body = "\n".join(_latex_row(row, len(sheet.columns)) for row in sheet.rows)
    # The class numbers tables itself.
    title = sheet.title.split(". ", 1)[-1]
    return (
        "\\begin{table*}\n\\centering\n\\small\n"
        f"\\caption{{{_escaped(f'{title}. {text}'.strip())}}}\n"
        f"\\begin{{tabular}}{{l{'r' * len(sheet.columns)}}}\n\\hline\n{head} \\\\\n"
        f"{body}\n\\hline\n\\end{{tabular}}\n\\end{{table*}}"
    )


def _latex_row(row: Row, columns: int) -> str:
    label = _escaped(row.label)
    if not row.cells:
        return f"\\hline\n\\multicolumn{{{columns + 1}}}{{l}}{{\\textbf{{{label}}}}} \\\\"
    if row.published:
        label = f"\\emph{{{label}}}"
    return " & ".join([label, *row.cells]) + r" \\"


def _escaped(text: str) -> str:
    return "".join(_ESCAPED.get(character, character) for character in text)


def _document(tables: Sequence[PaperTable], made: FigureOrigin) -> dict[str, Any]:
    return {
        "tables": [
            {
                "number": table.number,
                "title": table.title,
                "columns": [asdict(c) for c in (*table.columns, *table.corrected)],
                "sections": [asdict(section) for section in table.sections],
                "verdicts": table.verdicts,
            }
            for table in tables
        ],
        "caption": caption(made),
    }
