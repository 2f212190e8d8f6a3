"""`omocap calibrate session`: the object scanned and the phone clamped within one ARKit session."""

from typing import Any

from capture_app.cli import options as shared
from capture_app.cli.calibrate import options as given
from capture_app.cli.derived import derived
from capture_app.commands.calibrate.by_phone import SessionWay


@derived(SessionWay)
def session(session: shared.Session, mount_file: given.MountFile, **said: Any) -> None:
    """Scan the object, then clamp the phone to it without stopping the log or moving the object.

    The clamped phone's pose while it stands still, and the object's place in the same world, give
    the mount. If the object is back on its mark at the end, that rest counts too.
    """
    from capture_app.cli.calibrate.finish import carry_out

    carry_out(SessionWay, {**said, "session": session}, mount_file)
