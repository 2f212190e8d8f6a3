"""`omocap scan`: a film or photos of an object, or a mesh of another app, become its mesh."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from capture_app.cli import options as given
from capture_app.cli.console import output as console
from capture_app.cli.console import say

if TYPE_CHECKING:
    from capture_app.scanning.request import ScanRequest
    from capture_app.scanning.scan import Scan


class By(StrEnum):
    """What the surface is measured by."""

    auto = "auto"
    stereo = "stereo"
    depth = "depth"
    both = "both"


class Units(StrEnum):
    """Of a ready mesh."""

    m = "m"
    cm = "cm"
    mm = "mm"
    inches = "in"
    ft = "ft"


def _option(*names: str, text: str) -> typer.models.OptionInfo:
    return typer.Option(*names, help=text, show_default=False)


Source = Annotated[
    Path,
    typer.Argument(
        help="What the object was filmed with: a phone's session with pictures, photos, a video, a "
        "COLMAP model; or a mesh of another app (GLB, OBJ, PLY, STL, USDZ).",
        show_default=False,
    ),
]
Output = Annotated[Path, _option("-o", "--output", text="Mesh to write: .glb, .ply or .obj.")]
Height = Annotated[
    float | None,
    _option("--height", text="The object's height in metres, where nothing else tells its size."),
]
BoardText = Annotated[
    str | None,
    _option(
        "--board",
        text="A printed board lies beside the object and gives the size: A4, or such as "
        "5x7:35mm:26mm:DICT_5X5_100.",
    ),
]
LengthText = Annotated[
    str | None,
    _option(
        "--length",
        text="A length between two points picked in pictures gives the size: "
        "METRES:PICTURE,X,Y;PICTURE,X,Y:PICTURE,X,Y;PICTURE,X,Y.",
    ),
]
NoPoses = Annotated[bool, _option("--no-poses", text="Leave out the poses that the phone logged.")]
Axes = Annotated[
    str,
    typer.Option("--camera-axes", help="How logged poses are to be read, if an error says so."),
]
Metric = Annotated[
    bool, _option("--metric", text="The COLMAP model is in metres already, and z is up.")
]
Images = Annotated[
    Path | None, _option("--images", text="Folder of the pictures of a COLMAP model.")
]
Pictures = Annotated[int, typer.Option("--frames", help="Pictures to use.", min=12, max=400)]
BoxText = Annotated[
    str | None,
    _option(
        "--box",
        text="Where the object is: lowest and highest corner x,y,z,x,y,z in metres, as in the "
        "report of an earlier scan. Found if not given.",
    ),
]
Method = Annotated[
    By,
    typer.Option(
        help="Measure the surface by matching pictures (stereo), by the phone's LiDAR (depth), or by "
        "both; auto takes all there is."
    ),
]
Vertices = Annotated[int, typer.Option(help="Of the mesh, about.", min=500, max=100_000)]
UnitName = Annotated[Units | None, _option("--units", text="Of a mesh of another app.")]
ObjectName = Annotated[
    str | None, _option("--object-name", text="Which object of a mesh that holds several.")
]
Keep = Annotated[
    bool,
    typer.Option(
        "--keep/--no-keep",
        help="Keep what is slow to make, so that other options for the same film take seconds.",
    ),
]
Replace = Annotated[bool, _option("--replace", text="Replace an earlier mesh of the same name.")]


def scan(
    source: Source,
    mesh: Output,
    height: Height = None,
    board: BoardText = None,
    length: LengthText = None,
    no_poses: NoPoses = False,
    camera_axes: Axes = "logged",
    metric: Metric = False,
    images: Images = None,
    format_: given.Format = None,
    frames: Pictures = 80,
    box: BoxText = None,
    method: Method = By.auto,
    vertices: Vertices = 10_000,
    units: UnitName = None,
    object_name: ObjectName = None,
    keep: Keep = True,
    replace: Replace = False,
) -> None:
    """Make the object's mesh from a film of it: metres, z up, standing on its base.

    Walk around the object twice, once level with it and once from above. Beside object.glb comes the
    folder object.scan with a report (how good it is, what to film again) and the COLMAP model for
    `omocap calibrate scan`. An interrupted scan goes on when the same command is given again.
    """
    from capture_app.cli.console import progress_bars
    from capture_app.scanning.request import ScanRequest
    from capture_app.scanning.scan import scan_object
    from capture_app.scanning.words import given_box, picked_length
    from ingest.calibration.board.spec import parse_board
    from ingest.scan.cameras.options import CameraOptions

    request = ScanRequest(
        source=source,
        output=mesh,
        images=images,
        format=format_,
        frames=frames,
        cameras=CameraOptions(
            poses=not no_poses,
            axes=camera_axes,
            board=None if board is None else parse_board(board),
            length=picked_length(length),
            height=height,
            metric=metric,
        ),
        box=given_box(box),
        method=method.value,
        vertices=vertices,
        unit=None if units is None else units.value,
        object_name=object_name,
        keep=keep,
        replace=replace,
    )
    with progress_bars() as progress:
        made = scan_object(request, progress)
    _show(made)
    if not made.report.usable:
        raise typer.Exit(2)


def _show(made: "Scan") -> None:
    """Where everything is, and what the user should know about it."""
    from ingest.report.scanned import REPORT_PAGE

    request, report, solid = made.request, made.report, made.cleaned.mesh
    sides = " x ".join(
        f"{side:.2f}" for side in solid.vertices.max(axis=0) - solid.vertices.min(axis=0)
    )
    _headline(made)
    tight = "closed" if made.cleaned.watertight else "open"
    tight += " by what is made up" if made.cleaned.watertight and report.cut_off else ""
    console.print(f"{sides} m, {len(solid.vertices):,} vertices, {tight}", highlight=False)
    for check in (*report.of("bad"), *report.of("warn")):
        colour = "red" if check.severity == "bad" else "yellow"
        say(check.name.capitalize(), f"{check.message} {check.fix}".strip(), colour)
    say("Report", str(request.work / REPORT_PAGE), "bold")
    if made.found is not None and report.usable:
        say("Next", _next(request, made), "bold")


def _headline(made: "Scan") -> None:
    """The worst that was found, first."""
    took, output = f"{sum(made.seconds.values()):.0f} s", made.request.output
    if made.report.usable:
        limits = "; usable with limits" if made.report.severity == "warn" else ""
        say("Done", f"in {took}: {output}{limits}", "green" if not limits else "yellow")
        return
    why = ", ".join(check.name for check in made.report.of("bad"))
    if made.report.cut_off:
        why = "the film does not show the whole object"
    say("Not usable as it is", f"{why}; {output}, made in {took}, is for looking at.", "red")


def _next(request: "ScanRequest", made: "Scan") -> str:
    """How the phone is found in this scan once it is clamped."""
    from capture_app.scanning.folder import MODEL

    assert made.found is not None
    return (
        f"omocap calibrate scan {request.work / MODEL} --images {made.found.registered.images} "
        f"--object {request.output} --session CLAMPED -o mount.json"
    )
