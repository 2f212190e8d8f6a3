"""What a client may order of kind calibrate: recordings in the library become a mount."""

from typing import Literal

from pydantic import BaseModel

from capture_app.commands.calibrate import (
    BoardWay,
    FloorWay,
    ScanWay,
    SessionWay,
    TrackerWay,
    Way,
)
from capture_app.commands.inputs import PLACE_EXAMPLE, with_example
from capture_app.library_item import Name
from capture_app.web.by_id import by_id
from capture_app.web.library.ids import Id

_ID = "0123456789abcdef"


class Calibration(BaseModel):
    """What a calibration by any method needs."""

    kind: Literal["calibrate"]
    name: Name
    object: Id


_SCALE = ("mesh_scale",)
"""The library knows it."""


@by_id(BoardWay, leave_out=_SCALE)
class ByBoard(Calibration):
    """A second camera watched a printed board on the object while the clamped phone logged."""

    model_config = with_example(
        kind="calibrate", method="board", name="clamp", object=_ID, session=_ID, film=_ID,
        board="A4", place=PLACE_EXAMPLE,
    )  # fmt: skip

    method: Literal["board"]


@by_id(SessionWay, leave_out=_SCALE)
class BySession(Calibration):
    """The object filmed or scanned, then the phone clamped to it, in one recording.

    Where the object stood is said in exactly one way: `scan`, `object_pose`, or `board` with `place`.
    """

    model_config = with_example(
        kind="calibrate", method="session", name="clamp", object=_ID, session=_ID, scan=_ID
    )

    method: Literal["session"]


@by_id(ScanWay, leave_out=_SCALE)
class ByScan(Calibration):
    """What the clamped phone saw at rest, found again in the scan of the object.

    Without `model` in the scan that the object was made by.
    """

    model_config = with_example(
        kind="calibrate", method="scan", name="clamp", object=_ID, session=_ID
    )

    method: Literal["scan"]


@by_id(TrackerWay, leave_out=_SCALE)
class ByTracker(Calibration):
    """Motion capture or a tracker followed the object while the clamped phone logged."""

    model_config = with_example(
        kind="calibrate", method="tracker", name="clamp", object=_ID, session=_ID, poses=_ID
    )

    method: Literal["tracker"]


@by_id(FloorWay, leave_out=_SCALE)
class ByFloor(Calibration):
    """A mount made surer by a recording in which the object stands on the floor."""

    model_config = with_example(
        kind="calibrate", method="floor", name="clamp", object=_ID, mount=_ID, session=_ID
    )

    method: Literal["floor"]


WAYS: dict[type[Calibration], type[Way]] = {
    ByBoard: BoardWay,
    BySession: SessionWay,
    ByScan: ScanWay,
    ByTracker: TrackerWay,
    ByFloor: FloorWay,
}
"""The way that each becomes once paths have taken the place of ids."""
