"""Joins the calibrations into `omocap calibrate`; without a method it asks what you have."""

from collections.abc import Sequence
from typing import Any

import typer
from typer.core import TyperGroup

from capture_app.cli.calibrate import board_pdf, drawing, mounts, points, recorded


class _Guided(TyperGroup):
    """Without a method, `guide` is meant."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Name the command that an empty line means."""
        return super().parse_args(ctx, args or ["guide"])


app = typer.Typer(
    cls=_Guided,
    no_args_is_help=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def guide() -> None:
    """Ask what there is, guide through each recording, check it at once, and find the mount."""
    from capture_app.calibration.guide_flow import Guide
    from capture_app.calibration.guide_steps import Prompt
    from capture_app.cli.calibrate.finish import check_output
    from capture_app.cli.console import output

    Guide(Prompt(output), _run, check_output).go()


def _run(words: Sequence[str]) -> None:
    """Run a command of `omocap calibrate`, as if it had been typed."""
    command = typer.main.get_command(app)
    with command.make_context("omocap calibrate", list(words)) as context:
        command.invoke(context)


app.command("scan")(recorded.scan)
app.command("session")(recorded.session)
app.command("board")(recorded.board)
app.command("tracker")(recorded.tracker)
app.command("points")(points.points)
app.command("drawing")(drawing.drawing)
app.command("floor")(recorded.floor)
app.command("combine")(mounts.combine)
app.command("show")(mounts.show_mount)
app.command("board-pdf")(board_pdf.board_pdf)


@app.callback()
def calibrate() -> None:
    """Find where the phone sits on the object, and how sure that is; without a method: be guided.

    - **scan**: the clamped phone's pictures, found in the object's scan
    - **session**: object scanned and phone clamped in one recording
    - **board**: a second camera watches a printed board on the object
    - **tracker**: motion capture or a second tracker followed the object
    - **points**: three or more points known on phone and object
    - **drawing**: the drawing of a holder
    - **floor**: refines any of them by the object's contact with the floor
    - **combine**: several results of one mount become one, or are found to disagree
    """
