"""The words that the calibrations share."""

from pathlib import Path
from typing import Annotated

import typer

MountFile = Annotated[
    Path,
    typer.Option("-o", "--output", help="Mount file to write.", show_default=False),
]
Object = Annotated[
    Path,
    typer.Option(
        "--object",
        help="Mesh of the object: OBJ, PLY, STL or GLB, in metres; its frame is the one calibrated.",
        show_default=False,
    ),
]
MaybeObject = Annotated[
    Path | None,
    typer.Option(
        "--object", help="Mesh of the object, to note which one it is.", show_default=False
    ),
]
Phone = Annotated[
    str,
    typer.Option("--phone", help='Model of the phone, such as "iPhone 15".', show_default=False),
]
