"""A table as rows of text: what every way of writing it shares."""

from collections.abc import Iterator
from dataclasses import dataclass

from capture_app.tables.build import PaperTable
from capture_app.tables.paper import Column


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
        found: list[tuple[str, list[Row]]] = []
        for row in self.rows:
            if row.cells:
                found[-1][1].append(row)
            else:
                found.append((row.label, []))
        return found


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
