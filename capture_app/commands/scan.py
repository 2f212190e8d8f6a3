"""ScanRequest: what can be said about a film, photos or a mesh that are to become an object's mesh."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, model_validator

from capture_app.commands.inputs import (
    FromLibrary,
    LogFormat,
    OptionName,
    Positional,
    ShortText,
    shown,
)
from capture_app.commands.request import ItemRequest, place_of
from capture_app.commands.text_values import read_box, read_point
from ingest.scan.scan_choices import PICTURES, VERTICES, Method, Symmetry, Unit, Up

if TYPE_CHECKING:
    from ingest.scan.cameras.features import CameraOptions
    from ingest.scan.region import GivenBox


def _box(value: object, info: Any) -> object:
    return read_box(value, place_of(info)) if isinstance(value, str) else value


def _point(value: object, info: Any) -> object:
    return read_point(value, place_of(info)) if isinstance(value, str) else value


Corners = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]


class ScanOptions(BaseModel):
    """Options of a scan for the page and the command line alike."""

    model_config = ConfigDict(extra="forbid")

    height: Annotated[
        float | None,
        Field(
            title="Height of the object",
            gt=0,
            le=10,
            description="The object's height in metres, where nothing else tells its size; not used "
            "if not given.",
        ),
    ] = None
    board: Annotated[
        ShortText | None,
        Field(
            title="The board",
            description="What lies printed beside the object and gives the size: a board of omocap "
            "(A4, or such as 5x7:35mm:26mm:DICT_5X5_100), AprilTags or ArUco markers with the side of "
            "the black square (tag36h11:80mm, or DICT_4X4_50:50mm:7 for number 7 alone), or a plain "
            "checkerboard with its inner corners and the side of a square (checkerboard:9x6:25mm). None is "
            "looked for if not given.",
        ),
    ] = None
    length: Annotated[
        str | None,
        Field(
            max_length=2000,
            description="A length between two points picked in pictures gives the size: "
            "METRES:PICTURE,X,Y;PICTURE,X,Y:PICTURE,X,Y;PICTURE,X,Y. Not used if not given.",
        ),
    ] = None
    poses: Annotated[
        bool,
        Field(title="Use the phone's poses", description="Use the poses that the phone logged."),
    ] = True
    camera_axes: Annotated[
        ShortText, Field(description="How logged poses are to be read, if an error says so.")
    ] = "logged"
    metric: Annotated[
        bool, Field(description="The COLMAP model is in metres already, and z is up.")
    ] = False
    format: LogFormat = None
    frames: Annotated[
        int, Field(title="Pictures to use", ge=12, le=400, description="How many pictures to use.")
    ] = PICTURES
    box: Annotated[
        Annotated[Corners, BeforeValidator(_box)] | None,
        Field(
            description="Where the object is: lowest and highest corner x,y,z,x,y,z in metres, as in "
            "the report of an earlier scan. Found if not given."
        ),
    ] = None
    method: Annotated[
        Method,
        shown(words="auto: all there is; stereo: pictures alone; depth: the phone's LiDAR alone"),
        Field(
            title="Measure the surface by",
            description="Measure the surface by matching pictures (stereo), by the phone's LiDAR "
            "(depth), or by both; auto takes all there is. Or cut the object out of the room's mesh that "
            "the phone's app made (mesh).",
        ),
    ] = "auto"
    at: Annotated[
        Annotated[tuple[FiniteFloat, FiniteFloat, FiniteFloat], BeforeValidator(_point)] | None,
        Field(
            title="The place",
            description="A point x,y,z on the object in a mesh that holds more: what stands there is cut "
            "out. In metres, z up, as Blender shows it; the whole mesh is taken if not given.",
        ),
    ] = None
    symmetry: Annotated[
        Symmetry,
        shown(
            words="auto: where the film does not go around; on: wherever the object has it; "
            "off: nowhere, its halves differ"
        ),
        Field(
            title="Mirror symmetry",
            description="Let one half of a symmetric object show what the other hides: auto does so "
            "where the film does not go all around.",
        ),
    ] = "auto"
    texture: Annotated[
        bool,
        Field(
            title="Paint a texture",
            description="Paint a texture from the pictures. Without, GLB holds colours of vertices.",
        ),
    ] = True
    vertices: Annotated[
        int,
        Field(
            title="Corners of the mesh",
            ge=500,
            le=100_000,
            description="How many vertices the mesh has, about.",
        ),
    ] = VERTICES
    unit: Annotated[
        Unit | None,
        OptionName("--units"),
        Field(description="Unit of a mesh of another app; what its file says if not given."),
    ] = None
    up: Annotated[
        Up | None,
        Field(
            description="The axis of a mesh file that is up, where it does not say it; the file decides "
            "if not given."
        ),
    ] = None
    object_name: Annotated[
        ShortText | None,
        Field(
            description="Which object of a mesh that holds several; not given where there is one."
        ),
    ] = None
    draft: Annotated[
        bool,
        Field(
            title="A coarse draft",
            description="Make a coarse mesh from few pictures, in about a minute, to try a take at once.",
        ),
    ] = False

    @model_validator(mode="after")
    def _readable(self) -> "ScanOptions":
        _ = self.cameras
        return self

    @property
    def cameras(self) -> "CameraOptions":
        """The options for finding the cameras, and what gives the scale.

        Raises:
            InputError: "scan-length", or those of `parse_reference`.
        """
        from ingest.calibration.board.board_place import parse_reference
        from ingest.scan.cameras.features import CameraOptions, picked_length

        return CameraOptions(
            poses=self.poses,
            axes=self.camera_axes,
            board=None if self.board is None else parse_reference(self.board),
            length=picked_length(self.length),
            height=self.height,
            metric=self.metric,
            draft=self.draft,
        )

    @property
    def given_box(self) -> "GivenBox | None":
        """The box of the object, if it is not to be found."""
        import numpy as np

        from ingest.scan.region import GivenBox

        if self.box is None:
            return None
        corners = np.array(self.box).reshape(2, 3)
        return GivenBox(corners.min(axis=0), corners.max(axis=0))


class ScanRequest(ScanOptions, ItemRequest):
    """A film or photos of an object, or another app's mesh, become the object's mesh.

    The output is the mesh: .glb, .ply or .obj. A job's is the folder of a library item instead.
    """

    KIND: ClassVar[str] = "scan"
    READS: ClassVar[tuple[str, ...]] = ("source", "images")

    source: Annotated[
        Path,
        Positional(),
        FromLibrary(("session", "video", "material")),
        Field(
            description="What the object was filmed with: a phone's session with pictures, photos, a "
            "video, a COLMAP model; or a mesh of another app (GLB, OBJ, PLY, STL, USDZ)."
        ),
    ]
    images: Annotated[
        Path | None, Field(description="Folder of the pictures of a COLMAP model.")
    ] = None
    room: Annotated[
        str | None,
        OptionName("--mesh"),
        Field(
            max_length=2000,
            description="Use the room's mesh that the phone's app exported as further depth, or with "
            "--method mesh alone: a file, or app for the one in the session's folder.",
        ),
    ] = None
    keep: Annotated[
        bool,
        Field(
            description="Keep what is slow to make, so that other options for the same film take "
            "seconds."
        ),
    ] = True
    replace: Annotated[bool, Field(description="Replace an earlier mesh of the same name.")] = False

    @property
    def work(self) -> Path:
        """The folder beside the mesh: report, pictures, COLMAP model, and kept stages."""
        from ingest.report.take_inspection import work_folder

        return work_folder(self.output)
