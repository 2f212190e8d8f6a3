"""FigureTable: figures on the console, whole however narrow it is."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from capture_app.cli.console import output


@dataclass(frozen=True)
class FigureRow:
    """What a row is, and its figures."""

    labels: Sequence[str]
    figures: Sequence[str]
    dim: bool = False
    """It is printed in a dim style."""
    ends_section: bool = False
    """A line follows."""


@dataclass(frozen=True)
class FigureTable:
    """A table of figures; where it is too wide, its columns are spread over several tables."""

    title: str
    labels: Sequence[str]
    """Titles of the columns that say what a row is; every part of the table has them."""
    columns: Sequence[str]
    """Titles of the columns of figures."""
    rows: Sequence[FigureRow]

    def print(self) -> None:
        """Print the title and the parts that fit the console, of one column of figures at least."""
        output.print(Text(self.title, style="italic"), soft_wrap=True)
        for part in self._parts():
            # A part of one column may still be wider than the console, which then breaks its lines.
            part.width = _width(part)
            output.print(part, soft_wrap=True)

    def _parts(self) -> Iterator[Table]:
        first = 0
        while first < len(self.columns):
            last = len(self.columns)
            while last > first + 1 and _width(self._table(first, last)) > output.width:
                last -= 1
            yield self._table(first, last)
            first = last

    def _table(self, first: int, last: int) -> Table:
        """The table with some of its columns of figures."""
        table = Table(box=SIMPLE_HEAD, padding=0)
        for label in self.labels:
            table.add_column(Text(label), no_wrap=True)
        for title in self.columns[first:last]:
            table.add_column(Text(title), justify="right", no_wrap=True)
        for row in self.rows:
            cells = map(Text, (*row.labels, *row.figures[first:last]))
            style = "dim italic" if row.dim else ""
            table.add_row(*cells, style=style, end_section=row.ends_section)
        return table


def _width(table: Table) -> int:
    """Characters that the table needs for every cell to be whole."""
    return output.measure(table, options=output.options.update(width=10_000)).maximum
