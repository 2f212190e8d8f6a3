"""`omocap calibrate board`: a second camera watched a board on the object while the phone logged."""

from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given
from capture_app.cli.derived import derived
from capture_app.commands.calibrate.by_camera import BoardWay

Film = Annotated[
    Path,
    typer.Argument(
        help="What the second camera recorded: a video, a folder of pictures with times.csv, or the "
        "session of a second phone.",
        show_default=False,
    ),
]


@derived(BoardWay)
def board(session: shared.Session, film: Film, mount_file: given.MountFile, **said: Any) -> None:
    """Film a board on the object from a tripod while the clamped phone logs and you turn the object.

    Turn it by 30 to 60 degrees about two directions for 20 seconds. The clocks need not agree. Print
    a board with `omocap calibrate board-pdf`.
    """
    from capture_app.cli.calibrate.finish import carry_out

    carry_out(BoardWay, {**said, "session": session, "film": film}, mount_file)
