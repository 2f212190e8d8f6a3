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
Offset = Annotated[
    float | None,
    typer.Option(
        help="Seconds to add to the film's time to get the motion's; found by a board on the object.",
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
    from capture_app.overlay.aligned import draw, shows
    from capture_app.overlay.find import Said, find
    from capture_app.result import load_result, sample_index
    from render.overlay import OverlayStyle
    from render.video import write_moving

    loaded = load_result(result)
    index = sample_index(loaded, sample)
    said = Said(video, camera, board, board_at == BoardAt.room, board_place, shared_world, offset)
    with progress_bars() as progress:
        aligned = find(loaded, said, progress)
        style = OverlayStyle(thing.value, opacity, wipe)
        pictures = draw(
            loaded,
            index,
            aligned,
            style,
            backend=backend.value,
            samples=4 if smooth else 0,
        )
        count = len(aligned.seconds)
        told = (progress("video", (k + 1) / count) or p for k, p in enumerate(pictures))
        write_moving(target, told, aligned.fps)
    say("Done", str(target), "green")
    if not shows(loaded, index, aligned):
        say("Note", "The film never shows the place where the person was.", "yellow")
