"""The ways to calibrate a mount: what each needs, for command line, jobs, HTTP and page alike."""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, model_validator

from capture_app.commands.inputs import (
    LOG,
    BoardPlacement,
    CameraIntrinsics,
    DescribedModel,
    FromLibrary,
    Inline,
    LogFormat,
    Matrix,
    MeshFile,
    Number,
    OptionName,
    Point,
    Positional,
    ShortText,
    with_example,
)
from capture_app.commands.request import ItemRequest, place_of
from capture_app.commands.text_values import INTRINSICS, read_intrinsics, read_numbers, read_span
from omomo_core.errors import InputError

_MESH = "Mesh of the object: OBJ, PLY, STL or GLB, in metres; its frame is the one calibrated."
_RECORDING = ("Drop the recording here", "The folder your logger app wrote, or a zip of it.")
_MAYBE_MESH = "Mesh of the object, to note which one it is."
Object = Annotated[Path, Field(description=_MESH)]
MaybeObject = Annotated[Path | None, Field(description=_MAYBE_MESH)]
SessionPath = Annotated[
    Path,
    Positional(),
    FromLibrary(("session",), _RECORDING),
    Field(title="The recording", description=LOG),
]


class Way(BaseModel):
    """The fields that all ways have."""

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


class BoardWay(Way):
    """A second camera watched a printed board on the object while the clamped phone logged."""

    READS: ClassVar[tuple[str, ...]] = ("session", "film", "place", "camera")

    method: Literal["board"] = "board"
    object: MaybeObject = None
    session: SessionPath
    film: Annotated[
        Path,
        Positional(),
        FromLibrary(
            ("video", "session", "material"),
            (
                "Drop the second camera's film here",
                "A video (MP4, MOV), or choose a second phone's recording above.",
            ),
            ".mp4,.mov,.m4v",
        ),
        Field(
            title="The film",
            description="What the second camera recorded: a video, a folder of pictures with times.csv, "
            "or the session of a second phone.",
        ),
    ]
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
    poses: Annotated[
        Path,
        Positional(),
        FromLibrary(
            ("material",),
            ("Drop the tracker's log here", "Lines of t x y z qx qy qz qw."),
            ".csv,.txt,.tum",
        ),
        Field(
            title="The tracker's log",
            description="The tracker's log of the object in its own resting frame: lines of "
            "t x y z qx qy qz qw by blanks or commas; any clock.",
        ),
    ]
    body: Annotated[
        Path | None,
        Inline(Matrix, "body.txt"),
        Field(
            title="Its pose on the mesh",
            description="Where the tracked body is on the object (T_object_body, a 4x4 matrix as JSON or "
            "text); without it the body's frame is the mesh's.",
        ),
    ] = None


def _span(value: object) -> object:
    return read_span(value, "‹stills›") if isinstance(value, str) else value


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
        FromLibrary(
            ("material", "object"),
            (
                "Drop the mesh that the app made in that recording",
                "OBJ, PLY or GLB, not turned and not cropped; a folder if more belongs to it.",
            ),
        ),
        Field(
            title="The mesh of the recording",
            description="Mesh of the object that the app made in this very session, as it exports it "
            "(y up); not given with a pose or a board.",
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
                where="‹scan›, ‹object_pose›, ‹board›",
                fix="Give the scan's mesh, or the object's pose in the session's world, or the board "
                "that the phone filmed on it.",
            )
        if (self.board is None) != (self.place is None):
            raise InputError(
                "session-ways",
                "A board and its place on the object belong together.",
                where="‹board›, ‹place›",
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
    model: Annotated[
        Path | None,
        Positional(),
        FromLibrary(
            ("material",),
            (
                "Drop a COLMAP model with its pictures",
                "The folder that holds sparse and images; only if the object was scanned elsewhere.",
            ),
        ),
        Field(
            title="The model of the scan",
            description="COLMAP model of the scan: the folder with cameras, images and points3D.",
        ),
    ] = None
    """None for that of the scan which made the mesh."""
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
        FromLibrary(("session",), _RECORDING),
        Field(
            title="The recording",
            description="What the clamped phone's logger wrote, with its film; not given with photos.",
        ),
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
            title="From the model into the mesh's frame",
            description="File with the four rows of four that take the model's points into the object's "
            "frame in metres; its rotation may be scaled. Not needed if the model is in that frame.",
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
                where="‹session›, ‹photos›",
                fix="Give its session with the film, or a folder of photos with ‹intrinsics›.",
            )
        if self.photos is not None and not (self.intrinsics and min(self.intrinsics[:2]) > 0):
            raise InputError(
                "intrinsics-unreadable",
                "Photos need the camera's focal length and centre.",
                field="intrinsics",
                fix=INTRINSICS,
            )
        return self


class FloorWay(Way):
    """A mount made surer by a recording in which the object stands on the floor, or is pushed over it."""

    READS: ClassVar[tuple[str, ...]] = ("mount", "session")

    method: Literal["floor"] = "floor"
    object: Object
    mount: Annotated[
        Path,
        Positional(),
        FromLibrary(("mount",)),
        Field(
            title="The mount to be made surer",
            description="Mount file to refine, of the same clamping.",
        ),
    ]
    session: SessionPath
    phone_height: Annotated[
        float | None,
        Field(
            title="From the floor up to the lens, where the object first rests",
            gt=0,
            le=5,
            json_schema_extra={"unit": "m"},
            description="Metres from the floor up to the lens of the wide camera, measured with a tape "
            "where the object first rests; what the recording shows if not given.",
        ),
    ] = None
    floor: Annotated[
        FiniteFloat | None,
        Field(
            description="Height of the floor in the phone's world, metres (0 is where recording began, "
            "so it is negative); what the recording shows if not given."
        ),
    ] = None


def _three(value: object, info: Any) -> object:
    return read_numbers(value, 3, place_of(info)) if isinstance(value, str) else value


def _four(value: object, info: Any) -> object:
    return read_numbers(value, 4, place_of(info)) if isinstance(value, str) else value


def _pair(value: object) -> object:
    from ingest.calibration.point_pairs import typed_pair

    if not isinstance(value, str):
        return value
    pair = typed_pair(value)
    return {"phone": pair.phone, "point": pair.object}


Ruler = Annotated[tuple[Number, Number, Number, Number], BeforeValidator(_four)]
"""Width and height of a phone's body, its lens from the top and, seen from behind, from the left edge,
millimetres."""


class HandWay(Way):
    """The fields of both ways by hand; the lens of the phone may be measured."""

    object: MaybeObject = None
    ruler: Annotated[
        Ruler | None,
        Field(
            title="measure its lens",
            description='For a phone whose lens is not known: "WIDTH HEIGHT TOP SIDE" of its body and of '
            "the main lens from the top and, from behind, from the left edge, mm; "
            "not given for others.",
        ),
    ] = None


class DrawingWay(HandWay):
    """A holder's drawing says where the phone is: a matrix, or a place and one of three rotations."""

    READS: ClassVar[tuple[str, ...]] = ("matrix",)

    method: Literal["drawing"] = "drawing"
    of: Annotated[
        Literal["body", "camera"],
        Field(
            description="Whose pose it is: the body's (x right, y to the top, z out of the screen) or the "
            "camera's, in ARKit's axes."
        ),
    ] = "body"
    xyz: Annotated[
        Annotated[Point, BeforeValidator(_three)] | None,
        Field(
            title="Where it is, in the object's own axes",
            description='Where it is in the object\'s frame, metres: "0.10 0.22 0.05"; '
            "not given with a matrix.",
        ),
    ] = None
    point: Annotated[
        ShortText,
        Field(description='Point of the body that --xyz is for, such as "top left back corner".'),
    ] = "centre front"
    axes: Annotated[
        ShortText | None,
        Field(
            title="How it is turned",
            description='How the phone is turned, in words: "screen faces +x, top edge points +z"; '
            "not given with angles, a quaternion or a matrix.",
        ),
    ] = None
    euler: Annotated[
        ShortText | None,
        Field(
            description='Instead of axes: order and degrees, "xyz 0 90 0" about fixed axes, "XYZ 0 90 0" '
            "about turned ones."
        ),
    ] = None
    quaternion: Annotated[
        Annotated[tuple[Number, Number, Number, Number], BeforeValidator(_four)] | None,
        Field(description='Instead of axes, as a unit quaternion x y z w: "0 0 0 1".'),
    ] = None
    matrix: Annotated[
        Path | None,
        Field(description="File with the whole 4x4 pose in the object's frame."),
    ] = None
    sigma_mm: Annotated[
        float,
        Field(
            allow_inf_nan=False,
            ge=0,
            le=1000,
            description="One sigma of the place, mm; take 3 for a ruler.",
        ),
    ] = 1.0
    sigma_deg: Annotated[
        float,
        Field(
            allow_inf_nan=False,
            ge=0,
            le=180,
            description="One sigma of the direction, degrees; take 3 by eye.",
        ),
    ] = 1.0


class ClickedPair(DescribedModel):
    """A point on the phone, and the same point on the object."""

    model_config = ConfigDict(frozen=True) | with_example(
        phone="top left back corner", point=[0.1, 0.22, 0.05]
    )

    phone: ShortText | Point
    """Its name, or metres in the axes of the phone's camera."""
    point: Point
    """Metres in the object's frame."""


class PointsWay(HandWay):
    """Points that are known on the phone and on the object."""

    READS: ClassVar[tuple[str, ...]] = ("pair_file",)

    method: Literal["points"] = "points"
    pair_file: Path | None = None
    """CSV or JSON file of pairs, which come before the others."""
    pairs: Annotated[
        tuple[Annotated[ClickedPair, BeforeValidator(_pair)], ...],
        OptionName("--pair"),
        Field(
            max_length=200,
            description='A pair, such as "top left back corner = 0.10 0.22 0.05": a point of the phone by '
            "name or as x y z from its camera, and where it is on the object, metres. Repeat it.",
        ),
    ] = ()
    scale: Annotated[
        bool, Field(description="Solve for the scale of the mesh too, as in the paper.")
    ] = False
    sigma_mm: Annotated[
        float,
        OptionName("--sigma"),
        Field(
            allow_inf_nan=False,
            ge=0.01,
            le=100,
            description="By how many mm a point is off along each axis.",
        ),
    ] = 2.0


AnyWay = Annotated[
    BoardWay | SessionWay | ScanWay | TrackerWay | DrawingWay | PointsWay | FloorWay,
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
