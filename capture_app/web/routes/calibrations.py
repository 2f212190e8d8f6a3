"""What a client may order of kind calibrate: recordings in the library become a mount."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from capture_app.calibration.ways.requests import Ruler
from capture_app.things import Name
from capture_app.web.library.ids import Id

_ID = "0123456789abcdef"
_Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
Point = tuple[_Number, _Number, _Number]
_Row = tuple[_Number, _Number, _Number, _Number]
Matrix = tuple[_Row, _Row, _Row, _Row]
Words = Annotated[str, Field(max_length=200)]
_Seconds = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]
_PLACE = {
    "points": [
        {"board_mm": [0, 0], "object": [0.17, -0.06, 0.13]},
        {"board_mm": [175, 0], "object": [0.17, 0.12, 0.12]},
        {"board_mm": [175, 245], "object": [0.17, 0.1, -0.13]},
    ]
}


def like(**example: Any) -> ConfigDict:
    """Of a model with this example."""
    return ConfigDict(
        extra="forbid", allow_inf_nan=False, json_schema_extra={"examples": [example]}
    )


class PlacePoint(BaseModel):
    """A point of a printed board, and where it is on the object."""

    model_config = like(**_PLACE["points"][0])

    board_mm: tuple[_Number, _Number]
    """x and y on the print, from the corner where the arrows start."""
    object: Point
    """Metres in the object's frame."""


class Place(BaseModel):
    """Where a board is on the object."""

    model_config = like(**_PLACE)

    points: Annotated[list[PlacePoint], Field(min_length=3, max_length=200)]
    sigma_mm: Annotated[float, Field(gt=0, le=100)] = 2.0


class Camera(BaseModel):
    """The numbers of a camera, in pixels of its pictures."""

    model_config = like(fx=1430, fy=1430, cx=960, cy=540, width=1920, height=1080)

    fx: Annotated[float, Field(gt=0, le=1e6)]
    fy: Annotated[float, Field(gt=0, le=1e6)]
    cx: _Number
    cy: _Number
    distortion: Annotated[list[_Number], Field(max_length=14)] = []
    """OpenCV's k1 k2 p1 p2 k3 ..."""
    width: Annotated[int, Field(ge=16, le=16384)]
    height: Annotated[int, Field(ge=16, le=16384)]
    T_world_camera: Matrix | None = None
    """Where it stood in the world of a result: its x right, y down, z ahead."""


class _Calibrate(BaseModel):
    kind: Literal["calibrate"]
    name: Name
    object: Id
    phone: Words = ""


class ByBoard(_Calibrate):
    """A second camera watched a printed board on the object while the clamped phone logged."""

    model_config = like(
        kind="calibrate", method="board", name="clamp", object=_ID, session=_ID, film=_ID,
        board="A4", place=_PLACE,
    )  # fmt: skip

    method: Literal["board"]
    session: Id
    film: Id
    """A video, or the session of a second phone."""
    board: Words
    place: Place
    camera: Camera | None = None


class BySession(_Calibrate):
    """The object filmed or scanned, then the phone clamped to it, in one recording.

    Either `scan`, or `board` with `place`.
    """

    model_config = like(
        kind="calibrate", method="session", name="clamp", object=_ID, session=_ID, scan=_ID
    )

    method: Literal["session"]
    session: Id
    scan: Id | None = None
    """Mesh that the app made in that recording, brought as material."""
    board: Words | None = None
    place: Place | None = None
    clamped_at: _Seconds = 0.0


class ByScan(_Calibrate):
    """What the clamped phone saw at rest, found again in the scan of the object."""

    model_config = like(kind="calibrate", method="scan", name="clamp", object=_ID, session=_ID)

    method: Literal["scan"]
    session: Id
    model: Id | None = None
    """Material: a COLMAP model with its pictures; None for the object's own scan."""
    model_to_object: Matrix | None = None
    """Takes the model's points into the object's frame; its rotation may be scaled. None where the
    model is in that frame, in metres."""
    clamped_at: _Seconds = 0.0


class ByScreen(_Calibrate):
    """Photos that show a board on the phone's screen, and a printed one on the object."""

    model_config = like(
        kind="calibrate", method="screen", name="clamp", object=_ID, phone="iPhone 15", photos=_ID,
        board="A4", place=_PLACE,
    )  # fmt: skip

    method: Literal["screen"]
    photos: Id
    ruler: Ruler | None = None
    board: Words
    place: Place
    camera: Camera | None = None
    turned: Literal[0, 90, 180, 270] = 0


class ByTracker(_Calibrate):
    """Motion capture or a tracker followed the object while the clamped phone logged."""

    model_config = like(
        kind="calibrate", method="tracker", name="clamp", object=_ID, session=_ID, poses=_ID
    )

    method: Literal["tracker"]
    session: Id
    poses: Id
    """Material: lines of t x y z qx qy qz qw."""
    body: Matrix | None = None
    """Pose of the tracked body on the object; None where it has the mesh's frame."""


class ByFloor(_Calibrate):
    """A mount made surer by a recording in which the object stands on the floor."""

    model_config = like(
        kind="calibrate", method="floor", name="clamp", object=_ID, mount=_ID, session=_ID
    )

    method: Literal["floor"]
    mount: Id
    session: Id
    phone_height: Annotated[float, Field(gt=0, le=5)] | None = None
