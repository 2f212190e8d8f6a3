"""`omocap calibrate screen`: the phone shows a board, another camera sees it with the object."""

from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli.derived import derived
from capture_app.commands.calibrate.by_camera import ScreenWay
from capture_app.commands.request import validated

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
Learn = Annotated[
    Path | None,
    typer.Option(
        help="A mount of the same clamping, found in another way: write where the screen is in "
        "this phone, for --phone-file.",
        show_default=False,
    ),
]


@derived(ScreenWay, leave_out=("format",))
def screen(
    file: File,
    pictures: Pictures = None,
    show: Show = False,
    learn: Learn = None,
    **said: Any,
) -> None:
    """Find the mount from pictures of the phone's screen, which shows a board, and the object.

    First: omocap calibrate screen --show --phone "iPhone 15" -o tag.png, open it full screen on the
    phone with its rotation locked, and clamp the phone. Then take pictures from several sides with
    another camera, in which the screen and a board fixed on the object are seen (or scan the object
    with the phone on it).
    """
    from capture_app.cli.calibrate.finish import carry_out, check_free
    from capture_app.cli.calibrate.phone import needed_phone
    from capture_app.cli.calibrate.screen_steps import learn_screen, needed_pictures, write_picture

    if show:
        check_free(file)
        write_picture(needed_phone(said["phone"], said["ruler"]), file)
        return
    asked = {**said, "photos": needed_pictures(pictures)}
    if learn:
        check_free(file)
        learn_screen(validated(ScreenWay, asked, "option-invalid", prefix="--"), learn, file)
    else:
        carry_out(ScreenWay, asked, file)
