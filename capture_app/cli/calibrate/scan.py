"""`omocap calibrate scan`: the clamped phone's still pictures, found again in the object's scan."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from capture_app.cli.calibrate import options as given
from capture_app.cli.calibrate.stills import ClampedAt, Spans

if TYPE_CHECKING:
    from ingest.mount.scan.views import Views

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
) -> None:
    """Find the clamped phone in the scan of the object and its surroundings.

    The object stands where it was scanned while the clamped phone films for two seconds. If it is
    back on its mark at the end of the take, that rest counts too and shows whether the phone
    slipped.
    """
    from dataclasses import replace

    import numpy as np

    from capture_app.cli.calibrate.finish import check_output, finish
    from capture_app.cli.console import progress_bars
    from ingest.mesh import load_mesh
    from ingest.mount.pose_file import load_similarity
    from ingest.mount.scan.landmarks import read_landmarks
    from ingest.mount.scan.scan import scan_mount

    check_output(mount_file)
    solid = load_mesh(mesh)
    places, note = _places(session, photos, intrinsics, still, clamped_at)
    T, scale = (np.eye(4), 1.0) if to_object is None else load_similarity(to_object)
    T[:3, :3] *= scale
    landmarks = read_landmarks(model, images, database, T)
    with progress_bars() as progress:
        mount = scan_mount(landmarks, places, scale_sd=scale_sd / 100, progress=progress)
    notes = " ".join(text for text in (mount.note, note) if text)
    finish(replace(mount, note=notes), mount_file, solid, phone)


def _places(
    session: Path | None,
    photos: Path | None,
    intrinsics: str | None,
    still: list[str] | None,
    clamped_at: float,
) -> "tuple[list[Views], str]":
    from capture_app.cli.calibrate.stills import chosen_stills
    from ingest.formats.detect import read_session
    from ingest.mount.scan.views import views_in, views_of
    from omomo_core.errors import InputError

    if (session is None) == (photos is None):
        raise InputError(
            "scan-ways",
            "What the clamped phone saw must be given in exactly one way.",
            where="--session, --photos",
            fix="Give its session with the film, or a folder of photos with --intrinsics.",
        )
    if photos is not None:
        return [views_in(photos, _numbers(intrinsics))], ""
    assert session is not None
    log = read_session(session)
    stills, note = chosen_stills(log, still, clamped_at, 0.0)
    return [views_of(log, one) for one in stills], note


def _numbers(text: str | None):
    import numpy as np

    from omomo_core.errors import InputError

    try:
        values = np.array([float(part) for part in (text or "").split(",")])
        if values.shape != (4,) or not (np.isfinite(values).all() and (values[:2] > 0).all()):
            raise ValueError("not four numbers")
    except ValueError:
        raise InputError(
            "intrinsics-unreadable",
            "Photos need the camera's focal length and centre.",
            where="--intrinsics",
            fix="Write fx,fy,cx,cy in pixels of the photos, e.g. 3050,3050,2016,1512.",
        ) from None
    return values
