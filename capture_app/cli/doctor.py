"""`omocap doctor`: is everything here that omocap needs?"""

import typer
from rich.table import Table
from rich.text import Text

from capture_app.cli.console import output

_COLOUR = {"ok": "green", "warn": "yellow", "bad": "red"}


def doctor() -> None:
    """Look at this machine and this installation, and say how to mend what is missing.

    Exit code 0, or 2 when something that a run needs is missing.
    """
    from capture_app.doctor import examine

    table = Table(box=None, pad_edge=False, show_header=False)
    checks = list(examine())
    for check in checks:
        found = Text(check.found)
        if check.fix:
            found.append(f"\nfix: {check.fix}", style="dim")
        table.add_row(Text(check.level, style=_COLOUR[check.level]), check.name, found)
    output.print(table)
    if any(check.level == "bad" for check in checks):
        raise typer.Exit(2)
