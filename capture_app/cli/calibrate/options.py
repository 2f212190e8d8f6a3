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
MaybePhone = Annotated[
    str | None,
    typer.Option("--phone", help='Model of the phone, such as "iPhone 15".', show_default=False),
]
Ruler = Annotated[
    str | None,
    typer.Option(
        help='For a phone whose lens is not known: "WIDTH HEIGHT TOP SIDE" of its body and of the '
        "main lens from the top and, from behind, from the left edge, mm.",
        show_default=False,
    ),
]
