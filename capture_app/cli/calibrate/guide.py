"""`omocap calibrate` without a method: asks what you have and walks you through recording."""

from collections.abc import Sequence


def guide() -> None:
    """Ask what there is, guide through each recording, check it at once, and find the mount."""
    from capture_app.calibration.guide.flow import Guide
    from capture_app.calibration.guide.prompt import Prompt
    from capture_app.cli.calibrate.finish import check_output
    from capture_app.cli.console import output

    Guide(Prompt(output), _run, check_output).go()


def _run(words: Sequence[str]) -> None:
    """Run a command of `omocap calibrate`, as if it had been typed."""
    import typer

    from capture_app.cli.calibrate.app import app

    command = typer.main.get_command(app)
    with command.make_context("omocap calibrate", list(words)) as context:
        command.invoke(context)
