"""The steps of `omocap calibrate screen` beside the calibration: what the phone shows, and is."""

from pathlib import Path

from capture_app.cli.console import output
from capture_app.commands.calibrate.by_camera import ScreenWay
from ingest.calibration.phone.body import Phone
from omomo_core.errors import InputError


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


def write_picture(phone: Phone, path: Path) -> None:
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
    from capture_app.calibration.phones import need, phone_of
    from capture_app.calibration.ways.by_screen import learned_pose
    from ingest.calibration.screen.shown import save_screen_pose

    pose = learned_pose(way, known)
    save_screen_pose(pose, need(phone_of(way.phone, way.ruler)).name, file)
    output.print(f"Written: {file}", markup=False, soft_wrap=True)
