"""`omocap mcp`: tools for assistants that speak the Model Context Protocol."""

from pathlib import Path
from typing import Annotated

import typer

from omomo_core.errors import InputError

_Folder = Annotated[
    Path,
    typer.Option(
        exists=True,
        file_okay=False,
        help="Folder of recordings and results; nothing outside of it is read or written.",
        show_default=False,
    ),
]


def mcp(folder: _Folder) -> None:
    """Let an assistant inspect takes, make motions, look at them and export them, in one folder.

    A program that speaks the Model Context Protocol starts this and talks to it over stdin and stdout.
    """
    try:
        from capture_app.mcp_server import serve_mcp
    except ImportError as error:
        raise InputError(
            "mcp-extra-missing",
            f"The package {error.name} is not installed, and this server needs it.",
            fix="Install the extra: pip install '.[mcp]'",
        ) from error
    serve_mcp(folder)
