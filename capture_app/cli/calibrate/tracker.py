"""`omocap calibrate tracker`: another tracker (motion capture, a second phone) saw the object."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given


def tracker(
    session: shared.Session,
    poses: Annotated[
        Path,
        typer.Argument(
            help="The tracker's log of the object in its own resting frame: lines of "
            "t x y z qx qy qz qw by blanks or commas; any clock.",
            show_default=False,
        ),
    ],
    mount_file: given.MountFile,
    body: Annotated[
        Path | None,
        typer.Option(
            "--body",
            help="Where the tracked body is on the object (T_object_body, a 4x4 matrix as JSON or "
            "text); without it the body's frame is the mesh's.",
            show_default=False,
        ),
    ] = None,
    mesh: given.MaybeObject = None,
    phone: given.Phone = "",
    format_: shared.Format = None,
) -> None:
    """Calibrate from a recording in which phone and another tracker followed the same motion.

    Turn the object by 30 to 60 degrees about two directions, for 20 seconds or more. The clocks need
    not agree.
    """
    from capture_app.calibration.ways.requests import TrackerWay
    from capture_app.cli.calibrate.finish import carry_out

    way = TrackerWay(
        object=mesh, phone=phone, format=format_, session=session, poses=poses, body=body
    )
    carry_out(way, mount_file)
