"""`omocap calibrate screen`: the phone shows a board, another camera sees it with the object."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli.calibrate import options as given

Pictures = Annotated[
    Path | None,
    typer.Argument(
        help="Folder of PNG or JPEG pictures that show the phone's screen and the object.",
        show_default=False,
    ),
]
File = Annotated[
    Path,
    typer.Option(
        "-o",
        "--output",
        help="File to write: the picture with --show, else the mount (or the phone with --learn).",
        show_default=False,
    ),
]
Show = Annotated[
    bool, typer.Option("--show", help="Write the picture to open full screen on the phone.")
]
PhoneFile = Annotated[
    Path | None,
    typer.Option(help="Where this very phone's screen is, from --learn.", show_default=False),
]
Learn = Annotated[
    Path | None,
    typer.Option(
        help="A mount of the same clamping, found in another way: write where the screen is in "
        "this phone, for --phone-file.",
        show_default=False,
    ),
]
BoardText = Annotated[
    str | None,
    typer.Option(help="The board on the object, as printed on its sheet.", show_default=False),
]
Place = Annotated[
    Path | None,
    typer.Option(help="Where that board is on the object: JSON or CSV.", show_default=False),
]
CameraFile = Annotated[
    Path | None,
    typer.Option(
        "--camera",
        help="Intrinsics of the camera that took the pictures; calibrated from the board if not "
        "given.",
        show_default=False,
    ),
]
Model = Annotated[
    Path | None,
    typer.Option(
        help="Instead of a board: the COLMAP model of the scan, which has these pictures in it.",
        show_default=False,
    ),
]
ToObject = Annotated[
    Path | None,
    typer.Option(
        help="4x4 matrix that maps the model into the mesh's frame; none if the mesh was made in "
        "the model's own.",
        show_default=False,
    ),
]
Turned = Annotated[
    int,
    typer.Option(help="By how many degrees clockwise the picture stood on the screen: 0, 90..."),
]
Scale = Annotated[
    bool,
    typer.Option("--scale", help="The model has no scale of its own: take it from the screen."),
]


def screen(
    file: File,
    pictures: Pictures = None,
    phone: given.MaybePhone = None,
    ruler: given.Ruler = None,
    show: Show = False,
    board: BoardText = None,
    place: Place = None,
    camera: CameraFile = None,
    model: Model = None,
    to_object: ToObject = None,
    phone_file: PhoneFile = None,
    learn: Learn = None,
    turned: Turned = 0,
    scale: Scale = False,
    mesh: given.MaybeObject = None,
) -> None:
    """Find the mount from pictures of the phone's screen, which shows a board, and the object.

    First: omocap calibrate screen --show --phone "iPhone 15" -o tag.png, open it full screen on the
    phone with its rotation locked, and clamp the phone. Then take pictures from several sides with
    another camera, in which the screen and a board fixed on the object are seen (or scan the object
    with the phone on it).
    """
    from capture_app.calibration.ways.requests import ScreenWay
    from capture_app.cli.calibrate.finish import carry_out, check_free
    from capture_app.cli.calibrate.phone import needed_phone, ruler_of
    from capture_app.cli.calibrate.screen_steps import learn_screen, needed_pictures, write_picture

    if show:
        check_free(file)
        write_picture(needed_phone(phone, ruler), file)
        return
    way = ScreenWay(
        object=mesh,
        phone=phone or "",
        ruler=ruler_of(ruler),
        photos=needed_pictures(pictures),
        board=board,
        place=place,
        camera=camera,
        model=model,
        to_object=to_object,
        phone_file=phone_file,
        turned=turned,
        scale=scale,
    )
    if learn:
        check_free(file)
        learn_screen(way, learn, file)
    else:
        carry_out(way, file)
