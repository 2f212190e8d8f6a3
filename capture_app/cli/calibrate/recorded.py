"""`omocap calibrate scan`, `session`, `board`, `tracker` and `floor`: the ways by what was recorded."""

from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given
from capture_app.cli.derived import derived
from capture_app.commands.calibrate import BoardWay, FloorWay, ScanWay, SessionWay, TrackerWay

Model = Annotated[
    Path,
    typer.Argument(
        help="COLMAP model of the scan: the folder with cameras, images and points3D.",
        show_default=False,
    ),
]


@derived(ScanWay)
def scan(model: Model, mount_file: given.MountFile, **said: Any) -> None:
    """Find the clamped phone in the scan of the object and its surroundings.

    The object stands where it was scanned while the clamped phone films for two seconds. If it is
    back on its mark at the end of the take, that rest counts too and shows whether the phone
    slipped.
    """
    from capture_app.cli.calibrate.finish import carry_out

    carry_out(ScanWay, {**said, "model": model}, mount_file)


@derived(SessionWay)
def session(session: shared.Session, mount_file: given.MountFile, **said: Any) -> None:
    """Scan the object, then clamp the phone to it without stopping the log or moving the object.

    The clamped phone's pose while it stands still, and the object's place in the same world, give
    the mount. If the object is back on its mark at the end, that rest counts too.
    """
    from capture_app.cli.calibrate.finish import carry_out

    carry_out(SessionWay, {**said, "session": session}, mount_file)


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


Poses = Annotated[
    Path,
    typer.Argument(
        help="The tracker's log of the object in its own resting frame: lines of "
        "t x y z qx qy qz qw by blanks or commas; any clock.",
        show_default=False,
    ),
]


@derived(TrackerWay)
def tracker(
    session: shared.Session, poses: Poses, mount_file: given.MountFile, **said: Any
) -> None:
    """Calibrate from a recording in which phone and another tracker followed the same motion.

    Turn the object by 30 to 60 degrees about two directions, for 20 seconds or more. The clocks need
    not agree.
    """
    from capture_app.cli.calibrate.finish import carry_out

    carry_out(TrackerWay, {**said, "session": session, "poses": poses}, mount_file)


MountToRefine = Annotated[
    Path,
    typer.Argument(
        help="Mount file to refine, of the same clamping.",
        show_default=False,
    ),
]


@derived(FloorWay)
def floor(
    mount: MountToRefine, session: shared.Session, mount_file: given.MountFile, **said: Any
) -> None:
    """Refine a mount by a take in which the object stands on the floor, or is pushed over it.

    Each rest fixes how the object is tilted. Its height is fixed where the floor's is known: from
    depth maps, from --phone-height or --floor, or from rests on several sides.
    """
    from capture_app.cli.calibrate.finish import carry_out

    carry_out(FloorWay, {**said, "mount": mount, "session": session}, mount_file)
