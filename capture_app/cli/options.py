"""The words of the command line: arguments and options, each described once."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.commands.inputs import LOG, OptionGroup
from capture_app.commands.run import DRAW


class DrawingBackend(StrEnum):
    """The renderers that can draw the pictures."""

    auto = "auto"
    pyrender = "pyrender"
    raycast = "raycast"


def _option(*names: str, text: str, **rest: Any) -> Any:
    """An option whose default, if it has one worth showing, is said in its text."""
    return typer.Option(*names, help=text, show_default=False, **rest)


Session = Annotated[
    Path,
    typer.Argument(help=LOG, show_default=False),
]
Recording = Annotated[
    Path,
    typer.Argument(
        help="What the phone's logger wrote (folder, pose file or archive); or the object's own "
        "motion: GLB, glTF or USD, keyframes in CSV, poses in npz or TUM text.",
        show_default=False,
    ),
]
Result = Annotated[
    Path, typer.Argument(help="Result folder that `omocap run` wrote.", show_default=False)
]
ResultFolder = Annotated[Path, _option("-o", "--output", text="Result folder to make.")]
OutputFile = Annotated[
    Path | None,
    _option("-o", "--output", text="File to write; in the result folder if not given."),
]
ExportFile = Annotated[
    Path | None,
    _option(
        "-o",
        "--output",
        text="File to write, or a folder for it; in the result folder if not given.",
    ),
]
OptionalMesh = Annotated[
    Path | None, _option("--object", text="Mesh of the object, to find its floor.")
]
Seed = Annotated[int, typer.Option(help="The same seed gives the same motion.", min=0)]
Format = Annotated[
    str | None,
    _option(
        "--format",
        text="Read the log as that of this app (a name that `omocap formats` lists), whatever it looks like.",
    ),
]
Video = Annotated[bool, typer.Option(help=DRAW, rich_help_panel=OptionGroup.RESULT)]
Replace = Annotated[
    bool,
    _option(
        "--replace",
        text="Replace an earlier result of the same name.",
        rich_help_panel=OptionGroup.RESULT,
    ),
]
AsJson = Annotated[bool, _option("--json", text="Print the report as JSON, for programs.")]
Backend = Annotated[
    DrawingBackend, typer.Option(help="OpenGL (pyrender), or a ray caster that needs none.")
]
Steps = Annotated[
    int, typer.Option(help="Steps of the sampler; more is slower and finer.", min=1, max=1000)
]
Weights = Annotated[Path | None, _option(text="Folder of your own weights, from `omocap train`.")]
