"""`omocap export`: a result as a file of another program."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli import options as given
from capture_app.cli.console import say
from capture_app.exports.bone_names import Bones
from capture_app.exports.formats import Kind


class Rate(StrEnum):
    """Frames a second that programs work in."""

    film = "24"
    pal = "25"
    core = "30"
    game = "60"


class UpAxis(StrEnum):
    """Which axis points up."""

    y = "y"
    z = "z"


class Unit(StrEnum):
    """Of lengths."""

    m = "m"
    cm = "cm"


_To = Annotated[Kind, typer.Option("--to", help="Format.", show_default=False)]
_Output = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        help="File to write, or a folder for it; in the result folder if not given.",
        show_default=False,
    ),
]
_Fps = Annotated[Rate, typer.Option("--fps", help="Frames a second.")]
_Up = Annotated[
    UpAxis | None,
    typer.Option("--up", help="Up axis; what the format's readers expect if not given."),
]
_Units = Annotated[
    Unit | None,
    typer.Option("--units", help="Unit; what the format's readers expect if not given."),
]
_Bones = Annotated[Bones, typer.Option("--bones", help="Whose names the bones shall have.")]
_Skeleton = Annotated[
    Path | None,
    typer.Option(
        "--skeleton",
        help="Character to move instead of ours: BVH, GLB or VRM with bones named as one of --bones "
        "does, or a SMPL-X model file.",
        show_default=False,
    ),
]
_Blender = Annotated[
    str | None,
    typer.Option(
        "--blender", help="Blender that writes FBX, if it is not on the PATH.", show_default=False
    ),
]


def export(
    result: given.Result,
    to: _To,
    file: _Output = None,
    sample: given.Sample = None,
    fps: _Fps = Rate.core,
    up: _Up = None,
    units: _Units = None,
    bones: _Bones = Bones.smplx,
    skeleton: _Skeleton = None,
    blender: _Blender = None,
) -> None:
    """Write a result for another program: the person with the way they go, and the object.

    glb: Blender, Unity, Unreal, web pages. bvh: every animation program (the object in a second file).
    usd: Blender, Maya, Houdini, Unreal. fbx: through a Blender of yours. amass: SMPL-X npz for
    research. csv: positions for spreadsheets.

    Example: `omocap export chair_motion --to glb --bones unreal --fps 60 -o chair.glb`
    """
    from capture_app.exports.export import ExportOptions
    from capture_app.exports.of_result import export_result

    options = ExportOptions(
        kind=to,
        fps=float(fps),
        up=None if up is None else up.value,
        units=None if units is None else units.value,
        bones=bones,
        skeleton=skeleton,
        blender=blender,
    )
    written = export_result(result, file, sample, options)
    for note in written.notes:
        say("Note", note, "yellow")
    for path in written.files:
        say("Done", str(path), "green")
