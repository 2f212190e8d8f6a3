"""`omocap calibrate session`: the object scanned and the phone clamped within one ARKit session."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given
from capture_app.cli.calibrate.stills import ClampedAt, Spans

if TYPE_CHECKING:
    from ingest.mount.session.session import Placed
    from ingest.session import CaptureSession
    from omomo_core.motion import ObjectMesh

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
) -> None:
    """Scan the object, then clamp the phone to it without stopping the log or moving the object.

    The clamped phone's pose while it stands still, and the object's place in the same world, give
    the mount. If the object is back on its mark at the end, that rest counts too.
    """
    from dataclasses import replace

    from capture_app.cli.calibrate.finish import check_output, finish
    from capture_app.cli.calibrate.stills import chosen_stills
    from ingest.formats.detect import read_session
    from ingest.mesh import load_mesh
    from ingest.mount.session.session import session_mount
    from ingest.mount.still import CARRIED

    check_output(mount_file)
    _check_choice(scan, object_pose, board, place)
    log, solid = read_session(session), load_mesh(mesh)
    stills, note = chosen_stills(log, still, clamped_at, CARRIED)
    before = stills[0].start
    if board is not None and place is not None:
        placed = _by_board(log, board, place, before)
    else:
        placed = _by_mesh(log, solid, scan, object_pose, before)
    mount = session_mount(log, solid, placed, stills)
    finish(replace(mount, note=note), mount_file, solid, phone)


def _by_mesh(
    log: "CaptureSession",
    solid: "ObjectMesh",
    scan: Path | None,
    object_pose: Path | None,
    before: float,
) -> "Placed":
    from ingest.mount.pose_file import load_pose
    from ingest.mount.session.scan_mesh import load_scan
    from ingest.mount.session.session import placed_by_hand, placed_by_scan

    if object_pose is not None:
        return placed_by_hand(log, solid, load_pose(object_pose), before, str(object_pose))
    assert scan is not None
    return placed_by_scan(log, solid, load_scan(scan), before, str(scan))


def _by_board(log: "CaptureSession", text: str, place: Path, before: float) -> "Placed":
    from capture_app.cli.console import progress_bars
    from ingest.mount.board.place import load_place
    from ingest.mount.board.spec import parse_board
    from ingest.mount.board.track import track_session
    from ingest.mount.session.by_board import placed_by_board

    board = parse_board(text)
    where = load_place(place, board)
    with progress_bars() as progress:
        track = track_session(log, board, progress=progress)
    return placed_by_board(log, track, where, before)


def _check_choice(
    scan: Path | None, object_pose: Path | None, board: str | None, place: Path | None
) -> None:
    from omomo_core.errors import InputError

    if sum(way is not None for way in (scan, object_pose, board)) != 1:
        raise InputError(
            "session-ways",
            "Where the object stood must be said in exactly one way.",
            where="--scan, --object-pose, --board",
            fix="Give the scan's mesh, or the object's pose in the session's world, or the board "
            "that the phone filmed on it.",
        )
    if (board is None) != (place is None):
        raise InputError(
            "session-ways",
            "A board and its place on the object belong together.",
            where="--board, --board-place",
            fix="Give both.",
        )
