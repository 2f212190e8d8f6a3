"""`omocap calibrate drawing`: the mount by numbers, as a CAD drawing gives them."""

from typing import Any

from capture_app.cli.calibrate import options as given
from capture_app.cli.derived import derived
from capture_app.commands.calibrate import DrawingWay


@derived(DrawingWay, first=("phone", "ruler"), leave_out=("format",))
def drawing(mount_file: given.MountFile, **said: Any) -> None:
    """Write the mount of a holder whose drawing says where the phone is on the object.

    The body's pose needs the phone's model, which says where its camera is. Take the default sigmas
    for a printed holder.

    Example: omocap calibrate drawing --phone "iPhone 15" --xyz "0 0.12 0.31" --axes "screen faces
    +y, top edge points +z" -o mount.json
    """
    from capture_app.cli.calibrate.finish import carry_out

    carry_out(DrawingWay, said, mount_file)
