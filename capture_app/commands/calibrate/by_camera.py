"""The ways by what else watched: a camera that filmed a board, a tracker, or photos of the screen."""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, model_validator

from capture_app.commands.calibrate.way import MaybeObject, SessionPath, Way
from capture_app.commands.inputs import (
    BoardPlacement,
    CameraIntrinsics,
    FromLibrary,
    Inline,
    Matrix,
    OptionName,
    ShortText,
)
from capture_app.commands.request import place_of
from capture_app.commands.text_values import read_ruler
from omomo_core.errors import InputError


def _ruler(value: object, info: Any) -> object:
    return read_ruler(value, place_of(info)) if isinstance(value, str) else value


Ruler = Annotated[
    tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat], BeforeValidator(_ruler)
]
"""Width and height of a phone's body, its lens from the top and, seen from behind, from the left edge,
millimetres."""


class BoardWay(Way):
    """A second camera watched a printed board on the object while the clamped phone logged."""

    READS: ClassVar[tuple[str, ...]] = ("session", "film", "place", "camera")

    method: Literal["board"] = "board"
    object: MaybeObject = None
    session: SessionPath
    film: Annotated[Path, FromLibrary(("video", "session", "material"))]
    """A video, a folder of pictures with times.csv, or the session of a second phone."""
    board: Annotated[
        ShortText,
        Field(
            title="The board",
            description="The board, as its sheet says: A4, or such as 5x7:35mm:26mm:DICT_5X5_100; or a "
            "plain checkerboard by its inner corners and squares, such as checkerboard:9x6:25mm.",
        ),
    ]
    place: Annotated[
        Path,
        OptionName("--board-place"),
        Inline(BoardPlacement, "place.json"),
        Field(
            title="Where the board is on the object",
            description="File that says where the board is on the object: points, or a matrix.",
        ),
    ]
    camera: Annotated[
        Path | None,
        Inline(CameraIntrinsics, "camera.json"),
        Field(
            title="I know the second camera's numbers",
            description="Intrinsics of the second camera (JSON, or YAML of OpenCV or ROS); without them "
            "they are calibrated from the film.",
        ),
    ] = None


class TrackerWay(Way):
    """Motion capture or a tracker followed the object while the clamped phone logged."""

    READS: ClassVar[tuple[str, ...]] = ("session", "poses", "body")

    method: Literal["tracker"] = "tracker"
    object: MaybeObject = None
    session: SessionPath
    poses: Annotated[Path, FromLibrary(("material",))]
    """Lines of t x y z qx qy qz qw, in the tracker's own resting frame."""
    body: Annotated[
        Path | None,
        Inline(Matrix, "body.txt"),
        Field(
            title="The tracked body does not have the mesh's frame",
            description="Where the tracked body is on the object (T_object_body, a 4x4 matrix as JSON or "
            "text); without it the body's frame is the mesh's.",
        ),
    ] = None


class ScreenWay(Way):
    """The phone shows a board, and another camera sees it together with the object.

    How the object is known in the pictures is said in exactly one way: `board` with `place`, or `model`.
    """

    READS: ClassVar[tuple[str, ...]] = (
        "photos", "place", "camera", "model", "to_object", "phone_file"
    )  # fmt: skip

    method: Literal["screen"] = "screen"
    object: MaybeObject = None
    photos: Annotated[Path, FromLibrary(("material",))]
    """Folder of PNG or JPEG pictures that show the phone's screen and the object."""
    ruler: Annotated[
        Ruler | None,
        Field(
            title="measure its lens",
            description='For a phone whose lens is not known: "WIDTH HEIGHT TOP SIDE" of its body and of '
            "the main lens from the top and, from behind, from the left edge, mm.",
        ),
    ] = None
    board: Annotated[
        ShortText | None,
        Field(title="The board", description="The board on the object, as printed on its sheet."),
    ] = None
    place: Annotated[
        Path | None,
        Inline(BoardPlacement, "place.json"),
        Field(
            title="Where the board is on the object",
            description="Where that board is on the object: JSON or CSV.",
        ),
    ] = None
    camera: Annotated[
        Path | None,
        Inline(CameraIntrinsics, "camera.json"),
        Field(
            description="Intrinsics of the camera that took the pictures; calibrated from the board if "
            "not given."
        ),
    ] = None
    model: Annotated[
        Path | None,
        FromLibrary(("material",)),
        Field(
            description="Instead of a board: the COLMAP model of the scan, which has these pictures in "
            "it."
        ),
    ] = None
    to_object: Annotated[
        Path | None,
        Inline(Matrix, "to_object.txt"),
        Field(
            description="4x4 matrix that maps the model into the mesh's frame; none if the mesh was made "
            "in the model's own."
        ),
    ] = None
    phone_file: Annotated[
        Path | None, Field(description="Where this very phone's screen is, from --learn.")
    ] = None
    turned: Annotated[
        int,
        Field(
            title="The picture stands on the screen",
            ge=-270,
            le=270,
            description="By how many degrees clockwise the picture stood on the screen: 0, 90...",
        ),
    ] = 0
    scale: Annotated[
        bool,
        Field(description="The model has no scale of its own: take it from the screen."),
    ] = False

    @model_validator(mode="after")
    def _one_reference(self) -> "ScreenWay":
        if (self.model is None) == (self.board is None):
            raise InputError(
                "screen-reference",
                "What tells where the object is in the pictures is not given, or given twice.",
                fix="Name either --board with --place or --model.",
            )
        if self.board is not None and self.place is None:
            raise InputError(
                "screen-reference",
                "Where the board is on the object is not given.",
                where="--place",
                fix="Measure three of its corners on the mesh; see `omocap calibrate board --help`.",
            )
        return self
