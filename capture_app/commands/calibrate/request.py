"""CalibrateRequest: recordings become a mount, by any of the ways."""

from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field

from capture_app.commands.calibrate.by_camera import BoardWay, ScreenWay, TrackerWay
from capture_app.commands.calibrate.by_phone import FloorWay, ScanWay, SessionWay
from capture_app.commands.request import ItemRequest

AnyWay = Annotated[
    BoardWay | SessionWay | ScanWay | ScreenWay | TrackerWay | FloorWay,
    Field(discriminator="method"),
]


class CalibrateRequest(ItemRequest):
    """Recordings become a mount."""

    KIND: ClassVar[str] = "calibrate"

    way: AnyWay

    @property
    def inputs(self) -> dict[str, Path]:
        """Those of the way."""
        return self.way.inputs

    @property
    def options(self) -> dict[str, Any]:
        """Those of the way."""
        return self.way.options
