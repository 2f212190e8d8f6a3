"""`omocap calibrate board`: a second camera watched a board on the object while the phone logged."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given

Film = Annotated[
    Path,
    typer.Argument(
        help="What the second camera recorded: a video, a folder of pictures with times.csv, or the "
        "session of a second phone.",
        show_default=False,
    ),
]
BoardText = Annotated[
    str,
    typer.Option(
        "--board",
        help="The board, as its sheet says: A4, or such as 5x7:35mm:26mm:DICT_5X5_100.",
        show_default=False,
    ),
]
Place = Annotated[
    Path,
    typer.Option(
        "--board-place",
        help="File that says where the board is on the object: points, or a matrix.",
        show_default=False,
    ),
]
Camera = Annotated[
    Path | None,
    typer.Option(
        "--camera",
        help="Intrinsics of the second camera (JSON, or YAML of OpenCV or ROS); without them they "
        "are calibrated from the film.",
        show_default=False,
    ),
]


def board(
    session: shared.Session,
    film: Film,
    board: BoardText,
    place: Place,
    mount_file: given.MountFile,
    camera: Camera = None,
    mesh: given.MaybeObject = None,
    phone: given.Phone = "",
    format_: shared.Format = None,
) -> None:
    """Film a board on the object from a tripod while the clamped phone logs and you turn the object.

    Turn it by 30 to 60 degrees about two directions for 20 seconds. The clocks need not agree. Print
    a board with `omocap calibrate board-pdf`.
    """
    from capture_app.calibration.ways.requests import BoardWay
    from capture_app.cli.calibrate.finish import carry_out

    way = BoardWay(
        format=format_,
        object=mesh,
        phone=phone,
        session=session,
        film=film,
        board=board,
        place=place,
        camera=camera,
    )
    carry_out(way, mount_file)
