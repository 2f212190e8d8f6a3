"""`omocap doctor`: is everything here that omocap needs, and which numbers shape a motion?"""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from capture_app.cli import options
from capture_app.cli.console import in_options, output

if TYPE_CHECKING:
    from capture_app.doctor import HealthCheck
    from omomo_core.config import Number

_COLOUR = {"ok": "green", "warn": "yellow", "bad": "red"}


Config = Annotated[
    bool, typer.Option("--config", help="Print every number that shapes a motion instead.")
]


def doctor(config: Config = False, as_json: options.AsJson = False) -> None:
    """Look at this machine and this installation, and say how to mend what is missing.

    Exit code 0, or 2 when something that a run needs is missing.
    """
    if config:
        _print_config(as_json=as_json)
        return
    from capture_app.commands.spelling import all_in_options
    from capture_app.doctor import examine

    checks = list(examine())
    if as_json:
        output.print_json(data=all_in_options([asdict(check) for check in checks]))
    else:
        _print_checks(checks)
    if any(check.level == "bad" for check in checks):
        raise typer.Exit(2)


def _print_checks(checks: list["HealthCheck"]) -> None:
    table = Table(box=None, pad_edge=False, show_header=False)
    for check in checks:
        text = Text(check.found)
        if check.fix:
            text.append(f"\nfix: {in_options(check.fix)}", style="dim")
        table.add_row(Text(check.level, style=_COLOUR[check.level]), check.name, text)
    output.print(table)


def _print_config(*, as_json: bool) -> None:
    from capture_app.manifest_builder import MOTION_CONFIG
    from omomo_core.config import settings_of

    settings = list(settings_of(MOTION_CONFIG))
    if as_json:
        output.print_json(data=[asdict(one) for one in settings])
        return
    for one in settings:
        value = Text(f"{one.name} = {_written(one.value)} {one.unit}", style="bold")
        output.print(value, soft_wrap=True)
        output.print(Padding(Text(one.meaning), (0, 0, 0, 4)))


def _written(value: "Number") -> str:
    """Return a number as short as it can be, and a tuple of numbers in brackets."""
    if isinstance(value, tuple):
        return f"({', '.join(map(_written, value))})"
    return f"{value:g}"
