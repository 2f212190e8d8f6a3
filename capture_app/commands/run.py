"""RunRequest: everything that can be said about a take that is to become a motion.

An option is added here, in one place: `omocap run`, `omocap batch` and its tables, jobs, POST /api/jobs,
the manifest and `omocap rerun` take it from here.
"""

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, FiniteFloat

from capture_app.commands.inputs import OptionGroup, OptionName, Sample, shown
from capture_app.commands.reading import ReadingOptions
from capture_app.commands.render import RenderRequest, View
from capture_app.commands.request import Request, VideoSize, place_of
from capture_app.commands.text_values import read_place
from omomo_core.errors import InputError

if TYPE_CHECKING:
    from omomo_core.generation.generation_options import GenerationOptions


def _written(*words: str) -> BeforeValidator:
    """Return the validator of a place that may be written as text, or be one of some words."""

    def read(value: object, info: Any) -> object:
        return read_place(value, place_of(info), words) if isinstance(value, str) else value

    return BeforeValidator(read)


_SIDES = ("front", "back", "left", "right")
_Place = tuple[FiniteFloat, FiniteFloat]
Stood = Annotated[_Place | Literal["phone"], _written("phone")]
Ends = Annotated[_Place, _written()]
Side = Annotated[_Place | Literal["front", "back", "left", "right"], _written(*_SIDES)]

Size = Annotated[
    VideoSize | None,
    OptionGroup.RESULT,
    Field(description="Width x height of the pictures in pixels."),
]
VideoView = Annotated[
    View,
    OptionName("--view"),
    OptionGroup.RESULT,
    Field(description="View of the video; see `omocap render --help`."),
]
Replace = Annotated[
    bool, OptionGroup.RESULT, Field(description="Replace an earlier result of the same name.")
]


DRAW = "Draw a video."
"""Description of the choice whether a video is drawn."""
VIDEO = "motion.mp4"
"""Name of the video in a result folder."""
IDENTITY = "identity"
"""The word for a mount in whose place the mesh is made in the frame of the phone."""


class TakeOptions(ReadingOptions):
    """Options of a take and its motion for the page, the command line and tables alike."""

    samples: Annotated[
        int,
        Field(
            title="Samples",
            ge=1,
            le=64,
            description="How many motions to make; the best is chosen.",
        ),
    ] = 4
    seed: Annotated[
        int,
        OptionGroup.MOTION,
        Field(title="Seed", ge=0, lt=2**63, description="The same seed gives the same motion."),
    ] = 0
    steps: Annotated[
        int,
        OptionGroup.MOTION,
        Field(
            title="Steps of the sampler",
            ge=1,
            le=1000,
            description="Steps of the sampler; more is slower and finer.",
        ),
    ] = 7
    solve: Annotated[
        Literal["shown", "all"],
        shown(words="shown: the best sample; all: all samples"),
        OptionGroup.MOTION,
        Field(
            title="Solve at once",
            description="Which samples are solved at once: the one that is shown, or all. The others are "
            "solved when somebody looks at them.",
        ),
    ] = "shown"
    contact: Annotated[
        Literal["segments", "paper"],
        shown(words="segments: while it needs them; paper: from first touch to the end"),
        OptionGroup.MOTION,
        Field(
            title="Hands hold the object",
            description="When hands hold the object: while it needs to be held (segments), or from the "
            "first touch to the end, as published (paper).",
        ),
    ] = "segments"
    height: Annotated[
        float | None,
        shown("m"),
        Field(
            title="Height of the person",
            ge=0.8,
            le=2.6,
            description="Height of the person in metres; an average adult if not given.",
        ),
    ] = None
    stood: Annotated[
        Stood | None,
        Field(
            title="They stood elsewhere",
            description="Where the person stood when the take began, to about 30 cm: x,y on the floor "
            "of the result's world in metres, e.g. 0.8,-1.2; or the word phone, if the "
            "person stood before the phone's screen and tapped it to record; the program "
            "decides if not given. Every result says where its person begins.",
        ),
    ] = None
    ends: Annotated[
        Ends | None,
        OptionGroup.PERSON,
        Field(
            title="They ended elsewhere",
            description="Where the person stands as the take ends, to about 30 cm: x,y on the floor of "
            "the result's world in metres; the program decides if not given.",
        ),
    ] = None
    side: Annotated[
        Side | None,
        OptionGroup.PERSON,
        Field(
            title="Side of the object",
            description="On which side of the object the person is while they hold it: front, back, "
            "left or right, seen in the direction in which the object goes; or x,y, the place on the "
            "floor of the result's world where they are in the middle of the time that they first hold "
            "it, in metres; the program decides if not given.",
        ),
    ] = None
    hands: Annotated[
        Literal["auto", "one", "left", "right", "both"],
        shown(
            words="auto: as is likely; one: one of them; left: the left; right: the right; both: both"
        ),
        OptionGroup.PERSON,
        Field(
            title="Hands that hold it",
            description="Which hands of the person hold the object: one of them, the left, the right, or "
            "both together; auto leaves that to the program.",
        ),
    ] = "auto"
    force: Annotated[
        bool,
        OptionGroup.READING,
        Field(
            title="Use a recording that is not usable",
            description="Use a take that `omocap inspect` calls not usable. The motion will be wrong where "
            "the checks are bad.",
        ),
    ] = False
    strict: Annotated[
        bool,
        OptionGroup.RESULT,
        Field(
            title="Refuse what is usable with limits",
            description="Refuse a take of which `omocap inspect` finds anything that is to be looked at. "
            "No motion is made where a check is not fine.",
        ),
    ] = False


class ResultRequest(Request):
    """A result folder is to be made, and a video of it."""

    video_size: Size = (960, 540)
    """None makes no video."""
    video_view: VideoView = "third"
    replace: Replace = False

    @property
    def video(self) -> RenderRequest | None:
        """The request that draws the video, once the result is there."""
        if self.video_size is None:
            return None
        return RenderRequest(
            name=self.name,
            result=self.output,
            output=self.output / VIDEO,
            view=self.video_view,
            size=self.video_size,
        )


class RunRequest(TakeOptions, ResultRequest):
    """A take becomes a motion: its inputs, and all options."""

    KIND: ClassVar[str] = "run"
    READS: ClassVar[tuple[str, ...]] = ("session", "object", "mount", "body", "contacts")

    session: Path
    """What the phone's logger wrote, or a file of the object's own motion."""
    object: Annotated[
        Path | None,
        Field(
            title="The object",
            description="Mesh of the object: OBJ, PLY, STL or GLB, in metres. An animated GLB or USD "
            "has its own.",
        ),
    ] = None
    mount: Annotated[
        Path | None,
        Field(
            title="The mount",
            description="Mount file, which says where the object is in the phone's frame; or the word "
            "identity, if the mesh was made in the phone's own frame. An object's own "
            "motion takes no mount. TUM text is a phone's log if there is a mount, else the "
            "object's motion.",
        ),
    ] = None
    """None where the phone's frame is the object's."""
    node: Annotated[
        str | None,
        OptionGroup.READING,
        Field(
            description="Name of the object in an animated GLB or USD in which several things move."
        ),
    ] = None
    animated: bool = False
    """The session is the object's own motion; there is no phone and no mount."""
    contacts: Annotated[
        Path | None,
        OptionGroup.MOTION,
        Field(
            description="A contacts.json that says which hand holds the object when and where; decided "
            "by the program if not given."
        ),
    ] = None
    configuration: Annotated[
        Literal["capture", "paper"],
        OptionName("--config"),
        OptionGroup.MOTION,
        Field(
            description="Trained model: capture (made for this program) or paper (the published "
            "method)."
        ),
    ] = "capture"
    weights: Annotated[
        Path | None,
        OptionGroup.MOTION,
        Field(description="Folder of your own weights, from `omocap train`."),
    ] = None
    body: Annotated[
        Path | None,
        OptionGroup.MOTION,
        Field(description="Your own SMPL-X model file, as the body."),
    ] = None
    sampler: Literal["ddpm", "ddim", "dpm++"] = "dpm++"
    device: Annotated[
        Literal["cpu", "cuda", "mps"],
        OptionGroup.MOTION,
        Field(
            description="Where the two networks run: the processor (cpu) or a graphics card of NVIDIA "
            "(cuda) or Apple (mps). All else runs on the processor. Each rounds in its own way, so "
            "the motion of a seed differs a little between them."
        ),
    ] = "cpu"
    mesh_scale: Annotated[
        float,
        OptionGroup.READING,
        Field(
            title="Unit of the mesh's file",
            ge=1e-6,
            description="Factor to metres, e.g. 0.01 for a mesh in centimetres.",
        ),
    ] = 1.0

    @property
    def generation(self) -> "GenerationOptions":
        """The options of the generation."""
        from omomo_core.generation.generation_options import GenerationOptions

        names = (field.name for field in fields(GenerationOptions))
        return GenerationOptions(**{name: getattr(self, name) for name in names})

    @property
    def has_segments(self) -> bool:
        """Whether hands hold in segments, and not by the published rule."""
        return self.contact == "segments" and self.configuration == "capture"

    @property
    def recorded_options(self) -> dict[str, Any]:
        """Every option as the manifest has it: what a re-run needs beside the inputs."""
        left_out = {"name", "output", "replace", *self.READS}
        options = self.model_dump(exclude=left_out)
        size, weights = self.video_size, self.weights
        return options | {
            "weights": str(weights) if weights else None,
            "video_size": f"{size[0]}x{size[1]}" if size else None,
        }


class ResolveRequest(ResultRequest):
    """A result with corrected contacts becomes another one."""

    KIND: ClassVar[str] = "resolve"
    READS: ClassVar[tuple[str, ...]] = ("result", "contacts")

    result: Path
    contacts: Annotated[
        Path, Field(description="Contacts of the sample as you want them (contacts.json).")
    ]
    sample: Sample = None


def mount_file(mount: Path | str | None) -> Path | None:
    """The mount's file, None for the word identity.

    Raises:
        InputError: it is not given; the message explains what a mount is.
    """
    if mount is None:
        raise InputError(
            "mount-needed",
            "The mount is not given. The log says how the phone moved; the mount says where the "
            "object is as the phone sees it: a rotation and an offset in metres, which stay the "
            "same while the phone stays clamped.",
            field="mount",
            fix="Find it once per clamping with ‹omocap calibrate›, which asks what you have and writes the "
            "file for ‹mount›. Only if the mesh was made in the axes of the phone's camera, give "
            "‹mount› identity. A file of the object's own motion needs none: see docs/blender.md.",
        )
    return None if str(mount) == IDENTITY else Path(mount)
