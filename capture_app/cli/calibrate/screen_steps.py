"""The steps of `omocap calibrate screen`: the picture to show, and the pictures taken of it."""

from pathlib import Path
from typing import NamedTuple

from capture_app.cli.console import output
from ingest.mount.board.spec import Board
from ingest.mount.phone.body import Phone
from ingest.mount.screen.screen import Views
from omomo_core.errors import InputError


class Seen(NamedTuple):
    """What was given of the pictures, and of how the object is known in them."""

    pictures: Path | None
    board: str | None
    place: Path | None
    camera: Path | None
    model: Path | None
    to_object: Path | None


def write_picture(phone: Phone, path: Path) -> None:
    """Write the PNG for a phone's screen, and say what to do with it.

    Raises:
        InputError: "screen-unknown" or "picture-format".
    """
    import cv2

    from ingest.mount.screen.shown import screen_picture

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


def see(given: Seen, shown: Board) -> Views:
    """Read the pictures into poses, by the board on the object or by the scan's model.

    Raises:
        InputError: "screen-reference" when neither or both are given, or of what is read.
    """
    from ingest.mount.board.camera import load_camera
    from ingest.mount.board.place import load_place
    from ingest.mount.board.spec import parse_board
    from ingest.mount.pose_file import load_similarity
    from ingest.mount.screen.views import photos, views_in_model, views_with_board

    if given.pictures is None or (given.model is None) == (given.board is None):
        raise InputError(
            "screen-reference",
            "What tells where the object is in the pictures is not given, or given twice."
            if given.pictures
            else "The pictures are not given.",
            fix="Name the folder of pictures, and either --board with --place or --model; or make "
            "the picture for the phone first with --show.",
        )
    if given.model is not None:
        T, scale = load_similarity(given.to_object) if given.to_object else (None, 1.0)
        return views_in_model(photos(given.pictures), shown, given.model, T, scale)
    fixed = parse_board(given.board or "")
    if given.place is None:
        raise InputError(
            "screen-reference",
            "Where the board is on the object is not given.",
            where="--place",
            fix="Measure three of its corners on the mesh; see `omocap calibrate board --help`.",
        )
    camera = load_camera(given.camera) if given.camera else None
    return views_with_board(
        photos(given.pictures), shown, fixed, load_place(given.place, fixed), camera
    )
