"""`omocap simulate`: record the demonstration take with a simulated phone."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli.console import output, progress_bars


def simulate(
    folder: Annotated[Path, typer.Option("-o", "--output", help="Folder to write into.")],
    seed: Annotated[int, typer.Option(help="Of the phone's errors and of the room it films.")] = 0,
    perfect: Annotated[bool, typer.Option("--perfect", help="A phone without errors.")] = False,
    video: Annotated[bool, typer.Option(help="Draw what the phone films.")] = True,
) -> None:
    """Write what a phone clamped to a carried box would log with Stray Scanner: session, mesh and mount.

    The motion is known exactly, so that whatever reads the session can be checked against it.
    """
    from capture_app.simulator.demo_take import MESH, MOUNT, SESSION, record_demo
    from capture_app.simulator.simulated_phone import NO_NOISE
    from omomo_core.errors import InputError

    if folder.exists() and any(folder.iterdir()):
        raise InputError(
            "output-exists",
            "The output folder is not empty.",
            where=str(folder),
            fix="Name another folder, or empty this one.",
        )
    with progress_bars() as progress:
        record_demo(
            folder,
            seed=seed,
            noise=NO_NOISE if perfect else None,
            video=video,
            progress=progress,
        )
    output.print(
        f"Recorded. Make the motion with:\n  omocap run {folder / SESSION} --object {folder / MESH}"
        f" --mount {folder / MOUNT} -o RESULT",
        soft_wrap=True,
    )
