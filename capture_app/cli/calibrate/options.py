"""The words that the calibrations share."""

from pathlib import Path
from typing import Annotated

import typer

MountFile = Annotated[
    Path,
    typer.Option("-o", "--output", help="Mount file to write.", show_default=False),
]
MaybeObject = Annotated[
    Path | None,
    typer.Option(
        "--object", help="Mesh of the object, to note which one it is.", show_default=False
    ),
]
