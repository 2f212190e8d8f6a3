"""The `omocap` command: joins the subcommands and turns every failure into one clear paragraph."""

import logging
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated, Any

import typer
from rich.logging import RichHandler

from capture_app.cli import (
    batch,
    blender_extension,
    calibrate,
    compare,
    data,
    demo,
    doctor,
    evaluate,
    export,
    formats,
    inspect,
    mcp,
    overlay,
    render,
    replay,
    rerun,
    resolve,
    run,
    scan,
    serve,
    simulate,
    study,
    tables,
    train,
    worker,
)
from capture_app.cli.console import errors, report
from capture_app.cli.interrupts import INTERRUPTED, STOPPED, TERMINATED, was_interrupted
from omomo_core.errors import OmocapError

_HELP: dict[str, Any] = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    name="omocap",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings=_HELP,
)
app.command("run", help=run.HELP, no_args_is_help=True)(run.run)
app.command("inspect", no_args_is_help=True)(inspect.inspect)
app.command("scan", no_args_is_help=True)(scan.scan)
app.command("serve")(serve.serve)
app.command("replay", no_args_is_help=True)(replay.replay)
app.command("render", no_args_is_help=True)(render.render)
app.command("overlay", no_args_is_help=True)(overlay.overlay)
app.command("compare", no_args_is_help=True)(compare.compare)
app.command("export", no_args_is_help=True)(export.export)
app.command("blender-extension")(blender_extension.blender_extension)
app.command("batch", no_args_is_help=True)(batch.batch)
app.command("mcp", no_args_is_help=True)(mcp.mcp)
app.command("worker")(worker.worker)
app.command("rerun", no_args_is_help=True)(rerun.rerun)
app.command("resolve", no_args_is_help=True)(resolve.resolve)
app.command("doctor")(doctor.doctor)
app.command("formats")(formats.formats)
app.command("demo")(demo.demo)
app.command("simulate")(simulate.simulate)
app.command("train", no_args_is_help=True)(train.train)
app.command("evaluate", no_args_is_help=True)(evaluate.evaluate)
app.command("tables")(tables.tables)
app.add_typer(calibrate.app, name="calibrate")
app.add_typer(study.app, name="study")
app.add_typer(data.app, name="data")


def _show_version(asked: bool) -> bool:
    if asked:
        typer.echo(f"omocap {version('omocap')}")
        raise typer.Exit
    return asked


@app.callback()
def omocap(
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the Python traceback of an error.")
    ] = False,
    show_version: Annotated[
        bool,
        typer.Option(
            "--version", help="Show the version and stop.", callback=_show_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Clamp an iPhone to an object, move the object, get the motion of the person who moved it.

    Start with `omocap doctor`, look at a recording with `omocap inspect`, make the motion with
    `omocap run`.
    """


def run_command() -> int:
    """Run the command line of this process; returns its exit code, see `invoke`."""
    handler = RichHandler(console=errors, show_time=False, show_path=False)
    logging.basicConfig(level=logging.WARNING, format="%(message)s", handlers=[handler])
    return invoke(sys.argv[1:])


def invoke(arguments: Sequence[str]) -> int:
    """Run one command line.

    Returns:
        0 when it worked, 2 when the input cannot give a correct result, 130 when interrupted, 143 when
        terminated, and 1 for a defect of the program.
    """
    # Accepted anywhere, because it is added to the end of a command that has just failed.
    debug = "--debug" in arguments
    try:
        return _exit_code([a for a in arguments if a != "--debug"])
    except OmocapError as error:
        if debug:
            raise
        report(error)
        return 2
    except Exception as error:
        if was_interrupted():
            raise KeyboardInterrupt from None
        if debug:
            raise
        errors.print(
            f"[red]Error:[/] this is a defect of omocap: {type(error).__name__}.",
            "Run the same command with --debug and report what it prints.",
        )
        return 1


def _hide_types_of_flags(command: Any) -> None:
    """Let the help show no type beside a flag, which takes no value; of subcommands, too."""
    help_option = command.get_help_option(typer.Context(command, **_HELP))
    for option in (*command.params, help_option):
        if getattr(option, "is_flag", False):
            option.metavar = ""
    for subcommand in getattr(command, "commands", {}).values():
        _hide_types_of_flags(subcommand)


def _exit_code(arguments: list[str]) -> int:
    try:
        command = typer.main.get_command(app)
        _hide_types_of_flags(command)
        command(arguments)
    except SystemExit as done:
        code = done.code if isinstance(done.code, int) else 1
        if code in (INTERRUPTED, TERMINATED):
            errors.print(STOPPED)
        return code
    return 0
