"""`omocap calibrate floor`: refine a mount by the object's contact with the floor."""

from pathlib import Path
from typing import Annotated, Any

import typer

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given
from capture_app.cli.derived import derived
from capture_app.commands.calibrate.by_phone import FloorWay

MountToRefine = Annotated[
    Path,
    typer.Argument(
        help="Mount file to refine, of the same clamping.",
        show_default=False,
    ),
]


@derived(FloorWay)
def floor(
    mount: MountToRefine, session: shared.Session, mount_file: given.MountFile, **said: Any
) -> None:
    """Refine a mount by a take in which the object stands on the floor, or is pushed over it.

    Each rest fixes how the object is tilted. Its height is fixed where the floor's is known: from
    depth maps, from --phone-height or --floor, or from rests on several sides.
    """
    from capture_app.cli.calibrate.finish import carry_out

    carry_out(FloorWay, {**said, "mount": mount, "session": session}, mount_file)
