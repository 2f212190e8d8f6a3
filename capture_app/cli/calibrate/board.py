"""`omocap calibrate board`: a second camera watched a board on the object while the phone logged."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given

if TYPE_CHECKING:
    from ingest.mount.board.spec import Board
    from ingest.mount.board.track import BoardTrack

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
) -> None:
    """Film a board on the object from a tripod while the clamped phone logs and you turn the object.

    Turn it by 30 to 60 degrees about two directions for 20 seconds. The clocks need not agree. Print
    a board with `omocap calibrate board-pdf`.
    """
    from capture_app.cli.calibrate.finish import check_output, finish
    from ingest.formats.detect import read_session
    from ingest.mesh import load_mesh
    from ingest.mount.board.place import load_place
    from ingest.mount.board.spec import parse_board
    from ingest.mount.hand_eye.board import calibrate_by_board
    from ingest.mount.hand_eye.phone import phone_stream

    check_output(mount_file)
    printed = parse_board(board)
    where = load_place(place, printed)
    solid = load_mesh(mesh) if mesh else None
    stream = phone_stream(read_session(session))
    track = _track(film, printed, camera)
    finish(calibrate_by_board(stream, track, where), mount_file, solid, phone)


def _track(film: Path, board: "Board", camera: Path | None) -> "BoardTrack":
    """By what the film is: a second phone's session brings its own intrinsics and poses."""
    from capture_app.cli.console import progress_bars
    from ingest.formats.detect import read_session
    from ingest.mount.board.camera import load_camera
    from ingest.mount.board.track import track_session, track_video

    known = load_camera(camera) if camera else None
    pictures = film.is_file() or (film / "times.csv").is_file()
    with progress_bars() as progress:
        if pictures:
            return track_video(film, board, known, progress=progress)
        return track_session(read_session(film), board, progress=progress)
