"""What can be asked of drawing: one result again, or several beside each other."""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from capture_app.commands.inputs import OptionName, Sample, shown
from capture_app.commands.request import Request, VideoSize, place_of
from capture_app.commands.text_values import read_sheet

View = Literal["third", "orbit", "follow", "top", "object", "hands"]
Backend = Literal["auto", "pyrender", "raycast"]


def _sheet(value: object, info: Any) -> object:
    return read_sheet(value, place_of(info)) if isinstance(value, str) else value


_Few = Annotated[int, Field(ge=1, le=20)]
Still = Annotated[
    float | None,
    Field(
        description="Draw one PNG picture, at this time in seconds from the start of the motion."
    ),
]
Markers = Annotated[bool, Field(description="Show where hands hold, and the object's trail.")]
Smooth = Annotated[
    bool | None,
    shown(words=": in pictures alone; true: yes; false: no"),
    Field(
        title="Smooth edges",
        description="Smooth edges; a video takes half as long again. only PNGs have them if "
        "not given.",
    ),
]
DrawnBy = Annotated[
    Backend, Field(description="OpenGL (pyrender), or a ray caster that needs none.")
]


class RenderOptions(BaseModel):
    """Options of a video of a result that the page offers, too."""

    model_config = ConfigDict(extra="forbid")

    view: Annotated[
        View,
        shown(
            words="third: from the front; orbit: all around; follow: from behind, walking along; "
            "top: from above, as a map; object: from the object; hands: close to the hands"
        ),
        Field(
            title="Seen",
            description="third: person and object from the front; orbit: a slow circle around them; "
            "follow: behind the person; top: a map with its scale; object: what the clamped phone "
            "sees, or a view across the object at the person if it never sees them; hands: close to "
            "the hands that hold.",
        ),
    ] = "third"
    sample: Sample = None
    size: Annotated[VideoSize, Field(description="Width x height of the pictures in pixels.")] = (
        960,
        540,
    )


class RenderRequest(RenderOptions, Request):
    """A result becomes a video or a picture; the ending of the output decides.

    The output is .mp4, .webp or .gif; .png with `still` or `sheet`.
    """

    KIND: ClassVar[str] = "render"
    READS: ClassVar[tuple[str, ...]] = ("result", "robot", "frames")

    result: Path
    robot: Annotated[
        Path | None,
        Field(
            description="Draw this robot (MJCF or URDF) doing the motion in place of the person."
        ),
    ] = None
    frames: Annotated[
        Path | None,
        Field(description="File that maps the robot's bodies, if it is not a Unitree G1 or H1."),
    ] = None
    still: Still = None
    sheet: Annotated[
        Annotated[tuple[_Few, _Few], BeforeValidator(_sheet)] | None,
        Field(
            description="Draw one PNG of so many columns x rows of pictures, evenly over the motion, "
            "e.g. 4x3."
        ),
    ] = None
    markers: Markers = True
    smooth: Smooth = None
    backend: DrawnBy = "auto"

    @property
    def picture(self) -> bool:
        """Whether one file of PNG is drawn."""
        return self.still is not None or self.sheet is not None


class CompareRequest(Request):
    """Several motions side by side in one video or picture.

    The output is .mp4, .webp or .gif; .png with `still` or `sheet`.
    """

    KIND: ClassVar[str] = "compare"

    motions: Annotated[tuple[str, ...], Field(min_length=1, max_length=25)]
    """Result folders, RESULT#3 for the third sample, or recorded clips."""
    samples: Annotated[bool, Field(description="All samples of each result.")] = False
    rule: Annotated[
        Literal["paper"] | None,
        Field(description="After each result, the same person with contacts by the paper's rule."),
    ] = None
    heat: Annotated[
        bool, Field(description="Colour bodies by their distance from the first one.")
    ] = False
    any_object: Annotated[
        bool, OptionName("--any"), Field(description="Allow motions of different objects.")
    ] = False
    labels: tuple[str, ...] = ()
    """One for each motion, or none."""
    size: Annotated[
        VideoSize, Field(description="Width x height of each motion's picture in pixels.")
    ] = (480, 360)
    columns: Annotated[
        int | None, Field(ge=1, description="Motions side by side; 1 stacks them.")
    ] = None
    still: Still = None
    sheet: Annotated[
        int | None,
        Field(ge=1, le=24, description="One PNG with so many moments of each motion in a row."),
    ] = None
    figures: Annotated[
        Path | None, OptionName("--json"), Field(description="File to write every figure to.")
    ] = None
    markers: Markers = True
    smooth: Smooth = None
    backend: DrawnBy = "auto"

    @property
    def inputs(self) -> dict[str, Path]:
        """The motions, numbered from 1."""
        paths = enumerate(self.motions, 1)
        return {f"motion {k}": Path(text.rpartition("#")[0] or text) for k, text in paths}

    @property
    def picture(self) -> bool:
        """Whether one file of PNG is drawn."""
        return self.still is not None or self.sheet is not None
