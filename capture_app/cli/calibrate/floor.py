"""`omocap calibrate floor`: refine a mount by the object's contact with the floor."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given

Mount = Annotated[
    Path, typer.Argument(help="Mount file to refine, of the same clamping.", show_default=False)
]
PhoneHeight = Annotated[
    float | None,
    typer.Option(
        help="Metres from the floor up to the lens of the wide camera, measured with a tape where "
        "the object first rests.",
        show_default=False,
    ),
]
FloorHeight = Annotated[
    float | None,
    typer.Option(
        "--floor",
        help="Height of the floor in the phone's world, metres (0 is where recording began, so it "
        "is negative).",
        show_default=False,
    ),
]


def floor(
    mount: Mount,
    session: shared.Session,
    mesh: given.Object,
    mount_file: given.MountFile,
    phone_height: PhoneHeight = None,
    floor: FloorHeight = None,
    format_: shared.Format = None,
) -> None:
    """Refine a mount by a take in which the object stands on the floor, or is pushed over it.

    Each rest fixes how the object is tilted. Its height is fixed where the floor's is known: from
    depth maps, from --phone-height or --floor, or from rests on several sides.
    """
    from capture_app.calibration.ways.requests import FloorWay
    from capture_app.cli.calibrate.finish import carry_out

    way = FloorWay(
        format=format_,
        object=mesh,
        mount=mount,
        session=session,
        phone_height=phone_height,
        floor=floor,
    )
    carry_out(way, mount_file)
