"""The ways by what the clamped phone itself recorded: with the object's scan, a board, or the floor."""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, FiniteFloat, model_validator

from capture_app.commands.calibrate.way import Object, SessionPath, Way
from capture_app.commands.inputs import (
    BoardPlacement,
    FromLibrary,
    Inline,
    Matrix,
    OptionName,
    ShortText,
)
from capture_app.commands.request import place_of
from capture_app.commands.text_values import INTRINSICS, read_intrinsics, read_span
from omomo_core.errors import InputError


def _span(value: object) -> object:
    return read_span(value, "--still") if isinstance(value, str) else value


def _intrinsics(value: object, info: Any) -> object:
    return read_intrinsics(value, place_of(info)) if isinstance(value, str) else value


_Seconds = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]
Span = Annotated[tuple[_Seconds, _Seconds], BeforeValidator(_span)]
"""Seconds from the start of a log."""

Stills = Annotated[
    tuple[Span, ...],
    OptionName("--still"),
    Field(
        max_length=20,
        description="Seconds from the start of the log in which the clamped phone stands still and the "
        "object where it was scanned, e.g. 12.5:14; may be given several times. Found if not given.",
    ),
]
ClampedAt = Annotated[
    float,
    Field(
        ge=0,
        le=1e6,
        description="Seconds from the start of the log after which the phone is clamped; 0 finds it.",
    ),
]


class SessionWay(Way):
    """The object filmed or scanned, then the phone clamped to it, in one recording.

    Where the object stood is said in exactly one way: `scan`, `object_pose`, or `board` with `place`.
    """

    READS: ClassVar[tuple[str, ...]] = ("session", "scan", "object_pose", "place")

    method: Literal["session"] = "session"
    object: Object
    session: SessionPath
    scan: Annotated[
        Path | None,
        FromLibrary(("material", "object")),
        Field(
            title="The mesh of the recording",
            description="Mesh of the object that the app made in this very session, as it exports it "
            "(y up).",
        ),
    ] = None
    object_pose: Annotated[
        Path | None,
        Inline(Matrix, "object_pose.txt"),
        Field(
            description="Instead of a scan: file of the object's pose in the session's world, four rows "
            "of four (y up, metres)."
        ),
    ] = None
    board: Annotated[
        ShortText | None,
        Field(
            title="The board",
            description="Instead of a scan: the board on the object that the phone filmed before it was "
            "clamped, e.g. A4, 5x7:35mm:26mm:DICT_5X5_100 or checkerboard:9x6:25mm.",
        ),
    ] = None
    place: Annotated[
        Path | None,
        OptionName("--board-place"),
        Inline(BoardPlacement, "place.json"),
        Field(
            title="Where the board is on the object",
            description="With --board: file that says where it is on the object.",
        ),
    ] = None
    stills: Stills = ()
    clamped_at: ClampedAt = 0.0

    @model_validator(mode="after")
    def _one_way(self) -> "SessionWay":
        if sum(one is not None for one in (self.scan, self.object_pose, self.board)) != 1:
            raise InputError(
                "session-ways",
                "Where the object stood must be said in exactly one way.",
                where="--scan, --object-pose, --board",
                fix="Give the scan's mesh, or the object's pose in the session's world, or the board "
                "that the phone filmed on it.",
            )
        if (self.board is None) != (self.place is None):
            raise InputError(
                "session-ways",
                "A board and its place on the object belong together.",
                where="--board, --board-place",
                fix="Give both.",
            )
        return self


class ScanWay(Way):
    """What the clamped phone saw at rest, found again in the scan of the object.

    What it saw is said in exactly one way: `session`, or `photos` with `intrinsics`.
    """

    READS: ClassVar[tuple[str, ...]] = (
        "model", "images", "database", "session", "photos", "model_to_object"
    )  # fmt: skip

    method: Literal["scan"] = "scan"
    object: Object
    model: Annotated[Path | None, FromLibrary(("material",))] = None
    """Folder of a COLMAP model; None for that of the scan which made the mesh."""
    images: Annotated[
        Path | None,
        Field(
            description="Folder of the pictures that the model was made of; not needed with a database."
        ),
    ] = None
    database: Annotated[
        Path | None,
        Field(
            description="COLMAP's database.db of the same pictures; that of a scan is found beside its model."
        ),
    ] = None
    session: Annotated[
        Path | None,
        FromLibrary(("session",)),
        Field(description="What the clamped phone's logger wrote, with its film."),
    ] = None
    photos: Annotated[
        Path | None,
        FromLibrary(("material",)),
        Field(
            description="Instead of a session: folder of photos by the clamped phone, in landscape."
        ),
    ] = None
    intrinsics: Annotated[
        Annotated[
            tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat], BeforeValidator(_intrinsics)
        ]
        | None,
        Field(description="With --photos: fx,fy,cx,cy in pixels of the photos."),
    ] = None
    model_to_object: Annotated[
        Path | None,
        Inline(Matrix, "model_to_object.txt"),
        Field(
            description="File with the four rows of four that take the model's points into the object's "
            "frame in metres; its rotation may be scaled. Not needed if the model is in that frame."
        ),
    ] = None
    stills: Stills = ()
    clamped_at: ClampedAt = 0.0
    scale_sd: Annotated[
        float,
        Field(ge=0, le=20, description="How sure the model's scale is: one sigma, percent."),
    ] = 0.5

    @model_validator(mode="after")
    def _one_way(self) -> "ScanWay":
        if (self.session is None) == (self.photos is None):
            raise InputError(
                "scan-ways",
                "What the clamped phone saw must be given in exactly one way.",
                where="--session, --photos",
                fix="Give its session with the film, or a folder of photos with --intrinsics.",
            )
        if self.photos is not None and not (self.intrinsics and min(self.intrinsics[:2]) > 0):
            raise InputError(
                "intrinsics-unreadable",
                "Photos need the camera's focal length and centre.",
                where="--intrinsics",
                fix=INTRINSICS,
            )
        return self


class FloorWay(Way):
    """A mount made surer by a recording in which the object stands on the floor, or is pushed over it."""

    READS: ClassVar[tuple[str, ...]] = ("mount", "session")

    method: Literal["floor"] = "floor"
    object: Object
    mount: Annotated[Path, FromLibrary(("mount",))]
    session: SessionPath
    phone_height: Annotated[
        float | None,
        Field(
            title="From the floor up to the lens, where the object first rests",
            gt=0,
            le=5,
            description="Metres from the floor up to the lens of the wide camera, measured with a tape "
            "where the object first rests.",
        ),
    ] = None
    floor: Annotated[
        FiniteFloat | None,
        Field(
            description="Height of the floor in the phone's world, metres (0 is where recording began, "
            "so it is negative)."
        ),
    ] = None
