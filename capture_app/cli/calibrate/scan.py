"""`omocap calibrate scan`: the clamped phone's still pictures, found again in the object's scan."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given
from capture_app.cli.calibrate.stills import ClampedAt, Spans

Model = Annotated[
    Path,
    typer.Argument(
        help="COLMAP model of the scan: the folder with cameras, images and points3D.",
        show_default=False,
    ),
]
Images = Annotated[
    Path | None,
    typer.Option(
        help="Folder of the pictures that the model was made of; not needed with a database.",
        show_default=False,
    ),
]
DatabaseFile = Annotated[
    Path | None,
    typer.Option(
        "--database", help="COLMAP's database.db of the same pictures.", show_default=False
    ),
]
Session = Annotated[
    Path | None,
    typer.Option(help="What the clamped phone's logger wrote, with its film.", show_default=False),
]
Photos = Annotated[
    Path | None,
    typer.Option(
        help="Instead of a session: folder of photos by the clamped phone, in landscape.",
        show_default=False,
    ),
]
Intrinsics = Annotated[
    str | None,
    typer.Option(help="With --photos: fx,fy,cx,cy in pixels of the photos.", show_default=False),
]
ToObject = Annotated[
    Path | None,
    typer.Option(
        "--model-to-object",
        help="File with the four rows of four that take the model's points into the object's frame "
        "in metres; its rotation may be scaled. Not needed if the model is in that frame.",
        show_default=False,
    ),
]
ScaleSd = Annotated[
    float,
    typer.Option(help="How sure the model's scale is: one sigma, percent.", min=0.0, max=20.0),
]


def scan(
    model: Model,
    mesh: given.Object,
    mount_file: given.MountFile,
    images: Images = None,
    database: DatabaseFile = None,
    session: Session = None,
    photos: Photos = None,
    intrinsics: Intrinsics = None,
    to_object: ToObject = None,
    still: Spans = None,
    clamped_at: ClampedAt = 0.0,
    scale_sd: ScaleSd = 0.5,
    phone: given.Phone = "",
    format_: shared.Format = None,
) -> None:
    """Find the clamped phone in the scan of the object and its surroundings.

    The object stands where it was scanned while the clamped phone films for two seconds. If it is
    back on its mark at the end of the take, that rest counts too and shows whether the phone
    slipped.
    """
    from capture_app.calibration.ways.requests import ScanWay
    from capture_app.cli.calibrate.finish import carry_out
    from capture_app.cli.calibrate.stills import spans_of

    way = ScanWay(
        format=format_,
        object=mesh,
        phone=phone,
        model=model,
        images=images,
        database=database,
        session=session,
        photos=photos,
        intrinsics=_numbers(intrinsics),
        to_object=to_object,
        stills=spans_of(still),
        clamped_at=clamped_at,
        scale_sd=scale_sd,
    )
    carry_out(way, mount_file)


def _numbers(text: str | None) -> tuple[float, float, float, float] | None:
    """What is no four numbers is as if it was not given, which is told where it is needed."""
    try:
        fx, fy, cx, cy = (float(part) for part in (text or "").split(","))
    except ValueError:
        return None
    return fx, fy, cx, cy
