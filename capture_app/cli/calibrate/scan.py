"""`omocap calibrate scan`: the clamped phone's still pictures, found again in the object's scan."""

from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli.calibrate import options as given
from capture_app.cli.derived import derived
from capture_app.commands.calibrate.by_phone import ScanWay

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
