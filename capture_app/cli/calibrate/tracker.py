"""`omocap calibrate tracker`: another tracker (motion capture, a second phone) saw the object."""

from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given
from capture_app.cli.derived import derived
from capture_app.commands.calibrate.by_camera import TrackerWay

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
