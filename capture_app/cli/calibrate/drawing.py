"""`omocap calibrate drawing`: the mount by numbers, as a CAD drawing gives them."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli.calibrate import options as given


class Part(StrEnum):
    """What of the phone the numbers are for."""

    body = "body"
    camera = "camera"


Of = Annotated[
    Part,
    typer.Option(
        help="Whose pose it is: the body's (x right, y to the top, z out of the screen) or the "
        "camera's, in ARKit's axes."
    ),
]
Xyz = Annotated[
    str | None,
    typer.Option(
        help='Where it is in the object\'s frame, metres: "0.10 0.22 0.05".', show_default=False
    ),
]
Point = Annotated[
    str,
    typer.Option(help='Point of the body that --xyz is for, such as "top left back corner".'),
]
Axes = Annotated[
    str | None,
    typer.Option(
        help='How the phone is turned, in words: "screen faces +x, top edge points +z".',
        show_default=False,
    ),
]
Euler = Annotated[
    str | None,
    typer.Option(
        help='Order and degrees: "xyz 0 90 0" about fixed axes, "XYZ 0 90 0" about turned ones.',
        show_default=False,
    ),
]
Quaternion = Annotated[str | None, typer.Option(help='x y z w: "0 0 0 1".', show_default=False)]
Matrix = Annotated[
    Path | None,
    typer.Option(help="File with the whole 4x4 pose in the object's frame.", show_default=False),
]
SigmaMm = Annotated[
    float, typer.Option(help="One sigma of the place; take 3 for a ruler.", min=0.0, max=1000)
]
SigmaDeg = Annotated[
    float, typer.Option(help="One sigma of the direction; take 3 by eye.", min=0.0, max=180)
]


def drawing(
    mount_file: given.MountFile,
    phone: given.MaybePhone = None,
    ruler: given.Ruler = None,
    of: Of = Part.body,
    xyz: Xyz = None,
    point: Point = "centre front",
    axes: Axes = None,
    euler: Euler = None,
    quaternion: Quaternion = None,
    matrix: Matrix = None,
    sigma_mm: SigmaMm = 1.0,
    sigma_deg: SigmaDeg = 1.0,
    mesh: given.MaybeObject = None,
) -> None:
    """Write the mount of a holder whose drawing says where the phone is on the object.

    The body's pose needs the phone's model, which says where its camera is. Take the default sigmas
    for a printed holder.

    Example: omocap calibrate drawing --phone "iPhone 15" --xyz "0 0.12 0.31" --axes "screen faces
    +y, top edge points +z" -o mount.json
    """
    import numpy as np

    from capture_app.cli.calibrate.finish import check_output, finish, mesh_file_of
    from capture_app.cli.calibrate.phone import maybe_phone, needed_phone
    from ingest.calibration.drawn_mount import Drawn, Precision, body_mount, camera_mount

    check_output(mount_file)
    drawn = Drawn(xyz=xyz, axes=axes, euler=euler, quaternion=quaternion, matrix=matrix)
    precision = Precision(sigma_mm / 1e3, float(np.radians(sigma_deg)))
    if of is Part.camera:
        mount = camera_mount(drawn.of_camera(), precision)
        known = maybe_phone(phone, ruler)
    else:
        known = needed_phone(phone, ruler)
        T = drawn.of_body()
        mount = body_mount(known, T[:3, :3], T[:3, 3], point, precision)
    finish(mount, mount_file, mesh_file_of(mesh), known.name if known else "")
