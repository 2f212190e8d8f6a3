"""`omocap calibrate session`: the object scanned and the phone clamped within one ARKit session."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given
from capture_app.cli.calibrate.stills import ClampedAt, Spans

Scan = Annotated[
    Path | None,
    typer.Option(
        help="Mesh of the object that the app made in this very session, as it exports it (y up).",
        show_default=False,
    ),
]
ObjectPose = Annotated[
    Path | None,
    typer.Option(
        help="Instead of a scan: file of the object's pose in the session's world, four rows of "
        "four (y up, metres).",
        show_default=False,
    ),
]
BoardText = Annotated[
    str | None,
    typer.Option(
        "--board",
        help="Instead of a scan: the ChArUco board on the object that the phone filmed before it "
        "was clamped, e.g. A4 or 5x7:35mm:26mm:DICT_5X5_100.",
        show_default=False,
    ),
]
Place = Annotated[
    Path | None,
    typer.Option(
        "--board-place",
        help="With --board: file that says where it is on the object.",
        show_default=False,
    ),
]


def session(
    session: shared.Session,
    mesh: given.Object,
    mount_file: given.MountFile,
    scan: Scan = None,
    object_pose: ObjectPose = None,
    board: BoardText = None,
    place: Place = None,
    still: Spans = None,
    clamped_at: ClampedAt = 0.0,
    phone: given.Phone = "",
    format_: shared.Format = None,
) -> None:
    """Scan the object, then clamp the phone to it without stopping the log or moving the object.

    The clamped phone's pose while it stands still, and the object's place in the same world, give
    the mount. If the object is back on its mark at the end, that rest counts too.
    """
    from capture_app.calibration.ways.requests import SessionWay
    from capture_app.cli.calibrate.finish import carry_out
    from capture_app.cli.calibrate.stills import spans_of

    way = SessionWay(
        format=format_,
        object=mesh,
        phone=phone,
        session=session,
        scan=scan,
        object_pose=object_pose,
        board=board,
        place=place,
        stills=spans_of(still),
        clamped_at=clamped_at,
    )
    carry_out(way, mount_file)
