"""What a client may order: the requests of POST /api/jobs, with ids where the jobs have paths."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, Discriminator, Field, Tag

from capture_app.commands.export import ExportFormat, ExportRequest
from capture_app.commands.inputs import Sample, with_example
from capture_app.commands.overlay import OverlayRequest
from capture_app.commands.render import RenderOptions
from capture_app.commands.run import TakeOptions
from capture_app.commands.scan import ScanRequest
from capture_app.library_item import Name
from capture_app.web.by_id import by_id
from capture_app.web.library.ids import Id
from capture_app.web.routes.calibrations import (
    ByBoard,
    ByFloor,
    ByScan,
    BySession,
    ByTracker,
)
from capture_app.web.sources import MountChoice

_EXAMPLE_ID = "0123456789abcdef"
_Size = tuple[Annotated[int, Field(ge=64, le=3840)], Annotated[int, Field(ge=64, le=2160)]]


class RunOptions(TakeOptions):
    """How to make a motion; see `omocap run --help`."""

    model_config = with_example(samples=4, seed=0, height=1.72, up="object:z", floor=-0.8)

    video: bool = True


class Run(BaseModel):
    """A take becomes a motion."""

    model_config = with_example(
        kind="run", session=_EXAMPLE_ID, object=_EXAMPLE_ID, mount=_EXAMPLE_ID, options={"seed": 1}
    )

    kind: Literal["run"]
    name: Name | None = None
    session: Id
    object: Id | None = None
    mount: MountChoice | None = None
    """"identity" where the mesh is in the phone's own frame. A phone's log needs one or the other;
    an object's own motion has none."""
    contacts: Id | None = None
    options: RunOptions = RunOptions()


class Resolve(BaseModel):
    """A result with corrected contacts becomes another one."""

    model_config = with_example(
        kind="resolve",
        result=_EXAMPLE_ID,
        contacts={
            "version": 1,
            "fps": 30,
            "frames": 240,
            "segments": [{"hand": "left", "start": 12, "stop": 96, "anchor": [0.2, 0.0, 0.4]}],
        },
    )

    kind: Literal["resolve"]
    name: Name | None = None
    result: Id
    contacts: dict[str, Any]
    """The whole of contacts.json, as corrected."""
    sample: Sample = None
    video: bool = True


@by_id(ExportRequest, leave_out=("name", "output", "blender"))
class Export(BaseModel):
    """A result becomes a file of another program."""

    model_config = with_example(kind="export", result=_EXAMPLE_ID, to="glb", bones="unreal", fps=60)

    kind: Literal["export"]
    result: Id
    to: ExportFormat


class Render(RenderOptions):
    """A result becomes a video."""

    model_config = with_example(kind="render", result=_EXAMPLE_ID, view="orbit", size=[960, 540])

    kind: Literal["render"]
    result: Id
    size: _Size = (960, 540)
    """At most what others who wait can bear."""


class Compare(BaseModel):
    """Several results side by side in one video."""

    model_config = with_example(kind="compare", results=[_EXAMPLE_ID, "fedcba9876543210"])

    kind: Literal["compare"]
    results: Annotated[list[Id], Field(min_length=1, max_length=25)]
    samples: bool = False
    """All samples of each, not only the chosen one."""


@by_id(OverlayRequest, leave_out=("name", "output", "result", "backend"))
class Overlay(BaseModel):
    """A result drawn into a film of the take.

    Without `video` the clamped phone's own film. Where its camera stood is told by `board`, by
    `camera` with T_world_camera, by `scan`, or, for a second phone, by `shared_world`.
    """

    model_config = with_example(kind="overlay", result=_EXAMPLE_ID, video=_EXAMPLE_ID, board="A4")

    kind: Literal["overlay"]
    result: Id


@by_id(ScanRequest, leave_out=("output", "facts", "keep", "replace"))
class Scan(BaseModel):
    """A film or photos of an object, or a mesh of another app, become an object of the library."""

    model_config = with_example(kind="scan", name="chair", source=_EXAMPLE_ID, height=0.95)

    kind: Literal["scan"]
    name: Name
    room: Literal["app"] | None = None
    """Use the room's mesh that the phone's app exported into the session."""


def _tag(given: Any) -> str:
    """Which of the orders it is: by its kind, and a calibration by its method too."""
    said = given if isinstance(given, dict) else getattr(given, "__dict__", {})
    kind = said.get("kind")
    return f"{kind} by {said.get('method')}" if kind == "calibrate" else str(kind)


# A discriminator inside of another one is nothing that OpenAPI can describe.
Ordered = Annotated[
    Annotated[Run, Tag("run")]
    | Annotated[Resolve, Tag("resolve")]
    | Annotated[Export, Tag("export")]
    | Annotated[Render, Tag("render")]
    | Annotated[Compare, Tag("compare")]
    | Annotated[Overlay, Tag("overlay")]
    | Annotated[Scan, Tag("scan")]
    | Annotated[ByBoard, Tag("calibrate by board")]
    | Annotated[BySession, Tag("calibrate by session")]
    | Annotated[ByScan, Tag("calibrate by scan")]
    | Annotated[ByTracker, Tag("calibrate by tracker")]
    | Annotated[ByFloor, Tag("calibrate by floor")],
    Discriminator(
        _tag,
        custom_error_type="order_unknown",
        custom_error_message="there is no order of this kind, or no calibration by this method",
    ),
]
"""What POST /api/jobs takes."""
