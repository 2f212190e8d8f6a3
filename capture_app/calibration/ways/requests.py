"""What each way to find a mount needs, with plain paths; nothing is read here."""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field

from capture_app.solid import Solid

Ruler = tuple[float, float, float, float]
"""Width and height of a phone's body, its lens from the top and, seen from behind, from the left edge,
millimetres."""
Span = tuple[Annotated[float, Field(ge=0)], float]
"""Seconds from the start of a log."""


class Way(BaseModel):
    """What all of them have."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    READS: ClassVar[tuple[str, ...]] = ()
    """Fields that are paths of inputs, beside `object`, the mesh, which each way has."""

    mesh_scale: Annotated[float, Field(gt=0)] = 1.0
    """Brings it to metres."""
    phone: str = ""
    """Its model, e.g. "iPhone 15"."""
    format: str | None = None
    """Name of the format to read the phone's log as; None tells it by what it holds."""

    @property
    def solid(self) -> Solid | None:
        """The object, when it is given."""
        mesh = self.inputs.get("object")
        return None if mesh is None else Solid(mesh, self.mesh_scale)

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
    """A second camera watched a board on the object while the phone logged."""

    READS: ClassVar[tuple[str, ...]] = ("session", "film", "place", "camera")

    method: Literal["board"] = "board"
    object: Path | None = None
    session: Path
    film: Path
    """A video, a folder of pictures with times.csv, or the session of a second phone."""
    board: str
    """As its sheet says, e.g. A4."""
    place: Path
    """Where it is on the object; see `ingest.calibration.board.place`."""
    camera: Path | None = None
    """Intrinsics of the second camera; None finds them from the film."""


class SessionWay(Way):
    """Object scanned or filmed, then the phone clamped to it, within one ARKit session.

    Where the object stood is said in exactly one way: `scan`, `object_pose`, or `board` with `place`.
    """

    READS: ClassVar[tuple[str, ...]] = ("session", "scan", "object_pose", "place")

    method: Literal["session"] = "session"
    object: Path
    session: Path
    scan: Path | None = None
    """Mesh that the app made in this very session."""
    object_pose: Path | None = None
    """File of the object's pose in the session's world."""
    board: str | None = None
    """On the object, filmed by the phone before it was clamped."""
    place: Path | None = None
    stills: tuple[Span, ...] = ()
    """When the clamped phone stood still; found if not given."""
    clamped_at: Annotated[float, Field(ge=0)] = 0.0
    """Seconds from the start of the log; 0 finds it."""


class ScanWay(Way):
    """The clamped phone's still pictures, found again in the object's scan.

    What the phone saw is said in exactly one way: `session`, or `photos` with `intrinsics`.
    """

    READS: ClassVar[tuple[str, ...]] = (
        "model", "images", "database", "session", "photos", "to_object"
    )  # fmt: skip

    method: Literal["scan"] = "scan"
    object: Path
    model: Path
    """Folder of a COLMAP model."""
    images: Path | None = None
    """Folder of its pictures; not needed with `database`."""
    database: Path | None = None
    session: Path | None = None
    photos: Path | None = None
    intrinsics: tuple[float, float, float, float] | None = None
    """fx, fy, cx, cy in pixels of the photos."""
    to_object: Path | None = None
    """File of the similarity from the model into the object's frame."""
    stills: tuple[Span, ...] = ()
    clamped_at: Annotated[float, Field(ge=0)] = 0.0
    scale_sd: Annotated[float, Field(ge=0, le=20)] = 0.5
    """How sure the model's scale is: one sigma, percent."""


class ScreenWay(Way):
    """The phone shows a board, another camera sees it together with the object.

    How the object is known in the pictures is said in exactly one way: `board` with `place`, or `model`.
    """

    READS: ClassVar[tuple[str, ...]] = (
        "photos", "place", "camera", "model", "to_object", "phone_file"
    )  # fmt: skip

    method: Literal["screen"] = "screen"
    object: Path | None = None
    photos: Path
    ruler: Ruler | None = None
    """Measures a phone whose lens is not known."""
    board: str | None = None
    place: Path | None = None
    camera: Path | None = None
    model: Path | None = None
    to_object: Path | None = None
    phone_file: Path | None = None
    """Where this very phone's screen was found to be."""
    turned: int = 0
    """Degrees clockwise by which the picture stands on the screen."""
    scale: bool = False
    """Solve for the model's scale too."""


class TrackerWay(Way):
    """Motion capture or another tracker followed the object while the phone logged."""

    READS: ClassVar[tuple[str, ...]] = ("session", "poses", "body")

    method: Literal["tracker"] = "tracker"
    object: Path | None = None
    session: Path
    poses: Path
    """Lines of t x y z qx qy qz qw."""
    body: Path | None = None
    """File of the tracked body's pose on the object; None where it has the mesh's frame."""


class FloorWay(Way):
    """A mount refined by a take in which the object stands on the floor, or is pushed over it."""

    READS: ClassVar[tuple[str, ...]] = ("mount", "session")

    method: Literal["floor"] = "floor"
    object: Path
    mount: Path
    session: Path
    phone_height: float | None = None
    """Metres from the floor to the lens where the object first rests."""
    floor: float | None = None
    """Height of the floor in the phone's world, metres."""


AnyWay = Annotated[
    BoardWay | SessionWay | ScanWay | ScreenWay | TrackerWay | FloorWay,
    Field(discriminator="method"),
]
