"""`omocap overlay`: draw a result into a real film."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars, say
from omomo_core.whole_file import check_target

_KINDS = (".mp4", ".webp", ".gif")


class BoardAt(StrEnum):
    """What the board was fixed to."""

    object = "object"
    room = "room"


class Drawn(StrEnum):
    """What is drawn of the object."""

    outline = "outline"
    drawn = "drawn"
    hidden = "hidden"


Video = Annotated[
    Path | None,
    typer.Option(
        "--video",
        help="The film: a video file of a camera that stood still, or the session of a second phone; "
        "the clamped phone's own film if not given.",
        show_default=False,
    ),
]
Camera = Annotated[
    Path | None,
    typer.Option(
        "--camera",
        help="Intrinsics of the video's camera (JSON, or YAML of OpenCV or ROS); in JSON also "
        "T_world_camera, its pose in the result's world. With --board it may be left out.",
        show_default=False,
    ),
]
BoardText = Annotated[
    str | None,
    typer.Option(
        "--board",
        help="The board that the film shows, as its sheet says: A4, or 5x7:35mm:26mm:DICT_5X5_100.",
        show_default=False,
    ),
]
At = Annotated[
    BoardAt,
    typer.Option(
        "--board-at",
        help="Fixed to the object, or lying in the room (then the clamped phone saw it too, or "
        "--board-place says where).",
    ),
]
Place = Annotated[
    Path | None,
    typer.Option(
        "--board-place",
        help="Where the board is on the object (points or a matrix), or in the result's world (a "
        "matrix); without it the motion has to show it.",
        show_default=False,
    ),
]
Shared = Annotated[
    bool,
    typer.Option(
        "--shared-world",
        help="The second phone logged in the same ARKit world as the clamped one.",
        show_default=False,
    ),
]
ScanModel = Annotated[
    Path | None,
    typer.Option(
        "--scan",
        help="COLMAP model of the object where it stood before the take, and of its surroundings: "
        "the camera is found again in it.",
        show_default=False,
    ),
]
ScanImages = Annotated[
    Path | None,
    typer.Option("--scan-images", help="Folder of the model's pictures.", show_default=False),
]
ToObject = Annotated[
    Path | None,
    typer.Option(
        "--model-to-object",
        help="With --scan: the four rows of four that take the model's points into the object's frame.",
        show_default=False,
    ),
]
ScannedAt = Annotated[
    float,
    typer.Option(help="Second of the motion at which the object stood where it was scanned."),
]
Offset = Annotated[
    float | None,
    typer.Option(
        help="Seconds to add to the film's time to get the motion's; found by a board on the object, "
        "or by what moves in the film of a camera that stood still.",
        show_default=False,
    ),
]
Thing = Annotated[
    Drawn,
    typer.Option(
        "--object",
        help="Draw the object's outline, the object, or nothing of it; it hides what is behind it.",
    ),
]
Opacity = Annotated[float, typer.Option(help="Of what is drawn, 0 to 1.", min=0.0, max=1.0)]
Wipe = Annotated[
    bool,
    typer.Option(
        "--wipe", help="A line that goes to and fro between before and after.", show_default=False
    ),
]


def overlay(
    result: given.Result,
    video: Video = None,
    file: given.OutputFile = None,
    camera: Camera = None,
    board: BoardText = None,
    board_at: At = BoardAt.object,
    board_place: Place = None,
    shared_world: Shared = False,
    scan: ScanModel = None,
    scan_images: ScanImages = None,
    model_to_object: ToObject = None,
    scanned_at: ScannedAt = 0.0,
    offset: Offset = None,
    thing: Thing = Drawn.outline,
    opacity: Opacity = 1.0,
    wipe: Wipe = False,
    sample: given.Sample = None,
    smooth: given.Smooth = None,
    backend: given.Backend = given.DrawingBackend.auto,
) -> None:
    """Draw the person of a result into a film of the take: hidden by the object, with their shadow.

    The film is that of the clamped phone, of a camera on a tripod, or of a second phone.

    Example: `omocap overlay chair_motion --video tripod.mp4 --board A4 -o chair_overlay.mp4`
    """
    target = file or result / "overlay.mp4"
    check_target(target, _KINDS)
    from capture_app.overlay.find import Said
    from capture_app.overlay.in_scan import Scan
    from capture_app.overlay.write import OverlayRequest, overlay_result
    from render.overlay import OverlayStyle

    scanned = Scan(scan, scan_images, model_to_object, scanned_at) if scan else None
    in_room = board_at == BoardAt.room
    request = OverlayRequest(
        result,
        target,
        Said(video, camera, board, in_room, board_place, shared_world, scanned, offset),
        sample,
        OverlayStyle(thing.value, opacity, wipe),
        bool(smooth),
        backend.value,
    )
    with progress_bars() as progress:
        made = overlay_result(request, progress)
    say("Done", str(target), "green")
    for note in made.notes:
        say("Note", note, "yellow")
