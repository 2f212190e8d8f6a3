"""`omocap blender-extension`: the extension that brings results into Blender."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli.console import say


def blender_extension(
    file: Annotated[Path, typer.Option("-o", "--output", help="Zip file to write.")] = Path(
        "omocap.zip"
    ),
) -> None:
    """Write the extension for Blender 4.5 and later as a zip file that Blender installs.

    In Blender: drag the file into the window, or Preferences > Get Extensions > Install from Disk. It
    imports results, puts motions on your armature, and makes people for animated objects.

    Example: `omocap blender-extension -o omocap.zip`
    """
    from capture_app.exports.extension_zip import write_extension

    write_extension(file)
    say("Done", str(file), "green")
