"""`omocap calibrate screen`: the phone shows a board, another camera sees it with the object."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from capture_app.cli.console import output
from capture_app.cli.derived import derived
from capture_app.commands.calibrate import ScreenWay
from capture_app.commands.request import validated
from omomo_core.errors import InputError

if TYPE_CHECKING:
    from ingest.calibration.phone_body import Phone

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
    from capture_app.cli.calibrate.screen import learn_screen, needed_pictures, write_picture

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


def needed_pictures(folder: Path | None) -> Path:
    """The folder of pictures.

    Raises:
        InputError: "screen-reference" when it is not given.
    """
    if folder is None:
        raise InputError(
            "screen-reference",
            "The pictures are not given.",
            fix="Name the folder of pictures, and either --board with --place or --model; or make "
            "the picture for the phone first with --show.",
        )
    return folder


def write_picture(phone: "Phone", path: Path) -> None:
    """Write the PNG for a phone's screen, and say what to do with it.

    Raises:
        InputError: "screen-unknown" or "picture-format".
    """
    import cv2

    from ingest.calibration.screen.shown import screen_picture

    if path.suffix.lower() != ".png":
        raise InputError(
            "picture-format",
            "The picture must keep its pixels.",
            where=str(path),
            fix="Name a .png file.",
        )
    picture = screen_picture(phone)
    cv2.imwrite(str(path), picture)
    output.print(
        f"Written: {path} ({picture.shape[1]} x {picture.shape[0]})\n"
        "Send it to the phone without shrinking it (AirDrop, Files), lock the rotation upright, "
        "open it full screen in Photos, not zoomed, turn the brightness up and auto-lock off.",
        markup=False,
        soft_wrap=True,
    )


def learn_screen(way: ScreenWay, known: Path, file: Path) -> None:
    """Write where the screen is in this phone, by a known mount of the same clamping.

    Raises:
        InputError: as `learned_pose`, or the file cannot be written.
    """
    from capture_app.calibration.calibrate import learned_pose, need, phone_of
    from ingest.calibration.screen.shown import save_screen_pose

    pose = learned_pose(way, known)
    save_screen_pose(pose, need(phone_of(way.phone, way.ruler)).name, file)
    output.print(f"Written: {file}", markup=False, soft_wrap=True)
