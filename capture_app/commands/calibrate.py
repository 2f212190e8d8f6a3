"""Way: what all ways to calibrate a mount have, and the fields that several of them share.

The ways by what else watched: a camera that filmed a board, a tracker, or photos of the screen.

The ways by what the clamped phone itself recorded: with the object's scan, a board, or the floor.

CalibrateRequest: recordings become a mount, by any of the ways.
"""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, model_validator

from capture_app.commands.inputs import (
    BoardPlacement,
    CameraIntrinsics,
    FromLibrary,
    Inline,
    LogFormat,
    Matrix,
    MeshFile,
    OptionName,
    ShortText,
)
from capture_app.commands.request import ItemRequest, place_of
from capture_app.commands.text_values import INTRINSICS, read_intrinsics, read_ruler, read_span
from omomo_core.errors import InputError

_MESH = "Mesh of the object: OBJ, PLY, STL or GLB, in metres; its frame is the one calibrated."
_MAYBE_MESH = "Mesh of the object, to note which one it is."
Object = Annotated[Path, Field(description=_MESH)]
MaybeObject = Annotated[Path | None, Field(description=_MAYBE_MESH)]
SessionPath = Annotated[Path, FromLibrary(("session",))]


class Way(BaseModel):
    """What all ways have."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    READS: ClassVar[tuple[str, ...]] = ()
    """Fields that are paths of inputs, beside `object`, the mesh, which each way has."""

    mesh_scale: Annotated[float, Field(gt=0)] = 1.0
    """Factor that brings the mesh to metres."""
    phone: Annotated[
        ShortText, Field(title="Phone", description='Model of the phone, such as "iPhone 15".')
    ] = ""
    format: LogFormat = None

    @property
    def mesh_file(self) -> MeshFile | None:
        """The object's mesh, when it is given."""
        mesh = self.inputs.get("object")
        return None if mesh is None else MeshFile(mesh, self.mesh_scale)

    @property
    def inputs(self) -> dict[str, Path]:
        """The inputs that are given, by role."""
        roles = ("object", *self.READS)
        given: dict[str, Path | None] = {role: getattr(self, role) for role in roles}
        return {role: path for role, path in given.items() if path is not None}

    @property
    def options(self) -> dict[str, Any]:
        """What else is said, as JSON has it."""
        return self.model_dump(mode="json", exclude={"object", *self.READS})


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
