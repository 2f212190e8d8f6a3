"""`omocap calibrate show`: a mount file in words."""

from pathlib import Path
from typing import Annotated

import typer


def show_mount(
    mount: Annotated[Path, typer.Argument(help="Mount file.", show_default=False)],
) -> None:
    """Say what a mount file holds: where the object is, how sure that is, what was not seen."""
    from capture_app.cli.calibrate.finish import show
    from ingest.mount_file import load_mount

    show(load_mount(mount))
