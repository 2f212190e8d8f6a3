"""The tables as Markdown, LaTeX and JSON files."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from capture_app.tables.build import PaperTable
from capture_app.tables.caption import TableOrigin, caption
from capture_app.tables.sheet import Row, Sheet, sheets_of
from omomo_core.whole_file import write_whole

MARKDOWN, LATEX, JSON = "tables.md", "tables.tex", "tables.json"
_ESCAPED = {
    "\\": r"\textbackslash{}",
    **{c: f"\\{c}" for c in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


def write_tables(folder: Path, tables: Sequence[PaperTable], made: TableOrigin) -> list[Path]:
    """Write `tables.md`, `tables.tex` and `tables.json` into a folder.

    Raises:
        InputError: as `write_whole`.
    """
    texts = {
        MARKDOWN: markdown(tables, made),
        LATEX: latex(tables, made),
        JSON: json.dumps(_document(tables, made), indent=1) + "\n",
    }
    for name, text in texts.items():
        write_whole(folder / name, text)
    return [folder / name for name in texts]


def markdown(tables: Sequence[PaperTable], made: TableOrigin) -> str:
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


def latex(tables: Sequence[PaperTable], made: TableOrigin) -> str:
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


def _document(tables: Sequence[PaperTable], made: TableOrigin) -> dict[str, Any]:
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
        "made": asdict(made),
    }
