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
) -> None:
    """Calibrate from a recording in which phone and another tracker followed the same motion.

    Turn the object by 30 to 60 degrees about two directions, for 20 seconds or more. The clocks need
    not agree.
    """
    import numpy as np

    from capture_app.cli.calibrate.finish import check_output, finish
    from ingest.formats.detect import read_session
    from ingest.mesh import load_mesh
    from ingest.mount.hand_eye.phone import phone_stream
    from ingest.mount.hand_eye.pose_log import read_pose_log
    from ingest.mount.hand_eye.to_mount import calibrate_by_motion
    from ingest.mount.pose_file import load_pose
    from omomo_core.geometry.transforms import inverse

    check_output(mount_file)
    surface = load_mesh(mesh) if mesh else None
    T_object_body = load_pose(body) if body else np.eye(4)
    mount = calibrate_by_motion(
        phone_stream(read_session(session)),
        read_pose_log(poses),
        inverse(T_object_body),
        np.zeros((6, 6)),
        "tracker",
    )
    finish(mount, mount_file, surface, phone)
