"""OverlayRequest: what can be said about a result that is to be drawn into a film of the take."""

from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import AliasChoices, Field, FiniteFloat

from capture_app.commands.inputs import (
    BoardPlacement,
    CameraIntrinsics,
    FromLibrary,
    Inline,
    Matrix,
    OptionName,
    Sample,
    ShortText,
    shown,
)
from capture_app.commands.render import DrawnBy, Smooth
from capture_app.commands.request import Request


class OverlayRequest(Request):
    """A result is drawn into a film of the take.

    The output is .mp4, .webp or .gif. Where the camera stood is said by `board`, by `camera` with its
    pose, by `scan`, or, for a second phone, by `shared_world`.
    """

    KIND: ClassVar[str] = "overlay"
    READS: ClassVar[tuple[str, ...]] = (
        "result", "video", "camera", "board_place", "scan", "scan_images", "model_to_object"
    )  # fmt: skip

    result: Path
    video: Annotated[
        Path | None,
        FromLibrary(("video", "session")),
        Field(
            title="The film",
            description="The film: a video file of a camera that stood still, or the session of a second "
            "phone; the clamped phone's own film if not given.",
        ),
    ] = None
    camera: Annotated[
        Path | None,
        Inline(CameraIntrinsics, "camera.json"),
        Field(
            title="The camera's numbers",
            description="Intrinsics of the video's camera (JSON, or YAML of OpenCV or ROS); in JSON also "
            "T_world_camera, its pose in the result's world. With --board it may be left out.",
        ),
    ] = None
    board: Annotated[
        ShortText | None,
        Field(
            title="The board",
            description="The board that the film shows, as its sheet says: A4, or "
            "5x7:35mm:26mm:DICT_5X5_100. None is looked for if not given.",
        ),
    ] = None
    board_at: Annotated[
        Literal["object", "room"],
        Field(
            description="Fixed to the object, or lying in the room (then the clamped phone saw it too, "
            "or --board-place says where)."
        ),
    ] = "object"
    board_place: Annotated[
        Path | None,
        Inline(BoardPlacement, "place.json", name="place"),
        Field(
            title="I know where the board is on the object",
            description="Where the board is on the object (points or a matrix), or in the result's world "
            "(a matrix); without it the motion has to show it.",
        ),
    ] = None
    shared_world: Annotated[
        bool,
        Field(
            title="one ARKit world of both phones",
            description="The second phone logged in the same ARKit world as the clamped one.",
        ),
    ] = False
    scan: Annotated[
        Path | None,
        FromLibrary(("material",)),
        Field(
            description="COLMAP model of the object where it stood before the take, and of its "
            "surroundings: the camera is found again in it. Not used if not given."
        ),
    ] = None
    scan_images: Annotated[
        Path | None,
        Field(
            description="Folder of the model's pictures; not needed with a database beside the model."
        ),
    ] = None
    model_to_object: Annotated[
        Path | None,
        Inline(Matrix, "model_to_object.txt"),
        Field(
            description="With --scan: the four rows of four that take the model's points into the "
            "object's frame in metres."
        ),
    ] = None
    scanned_at: Annotated[
        FiniteFloat,
        Field(description="Second of the motion at which the object stood where it was scanned."),
    ] = 0.0
    offset: Annotated[
        FiniteFloat | None,
        shown("s"),
        Field(
            title="Add to the film's time to get the motion's",
            description="Seconds to add to the film's time to get the motion's; found by a board on the "
            "object, or by what moves in the film of a camera that stood still, if not given.",
        ),
    ] = None
    object_style: Annotated[
        Literal["outline", "drawn", "hidden"],
        OptionName("--object"),
        shown(words="outline: its outline; drawn: the object itself; hidden: nothing of it"),
        Field(
            title="Draw of the object",
            # The name that earlier clients of the page's API send is still understood.
            validation_alias=AliasChoices("object_style", "thing"),
            description="Draw the object's outline, the object, or nothing of it; it hides what is "
            "behind it.",
        ),
    ] = "outline"
    opacity: Annotated[
        float,
        Field(
            title="How solid the person is",
            ge=0,
            le=1,
            description="Opacity of what is drawn, 0 to 1.",
        ),
    ] = 1.0
    wipe: Annotated[
        bool,
        Field(
            title="A line that goes to and fro between before and after",
            description="A line that goes to and fro between before and after.",
        ),
    ] = False
    sample: Sample = None
    smooth: Smooth = None
    backend: DrawnBy = "auto"
