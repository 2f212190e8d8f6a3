"""What can be ordered: one model for each kind of job, with plain paths."""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

from capture_app.calibration.ways.requests import AnyWay
from ingest.trajectory.reading import Top

_Size = tuple[Annotated[int, Field(ge=64, le=7680)], Annotated[int, Field(ge=64, le=4320)]]
"""Width and height in pixels."""


class Order(BaseModel):
    """What all orders have."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    KIND: ClassVar[str]
    """Of the job, see `capture_app.jobs.kinds`."""
    READS: ClassVar[tuple[str, ...]] = ()
    """Fields that are paths of inputs."""

    name: str = ""
    """What its owner calls the job."""
    output: Path
    """The file or folder to make."""

    @property
    def inputs(self) -> dict[str, Path]:
        """The inputs that are given, by role."""
        given: dict[str, Path | None] = {role: getattr(self, role) for role in self.READS}
        return {role: path for role, path in given.items() if path is not None}

    @property
    def options(self) -> dict[str, Any]:
        """What else is ordered, as JSON has it."""
        return self.model_dump(mode="json", exclude={"name", "output", *self.READS})


class RunOrder(Order):
    """A take becomes a motion; mirrors `capture_app.request.TakeRequest`."""

    KIND: ClassVar[str] = "run"
    READS: ClassVar[tuple[str, ...]] = ("session", "object", "mount", "body", "contacts")

    session: Path
    object: Path | None = None
    mount: Path | None = None
    """None where the phone's frame is the object's."""
    node: str | None = None
    animated: bool = False
    seed: Annotated[int, Field(ge=0)] = 0
    samples: Annotated[int, Field(ge=1, le=64)] = 4
    contact: Literal["segments", "paper"] = "segments"
    sampler: Literal["ddpm", "ddim", "dpm++"] = "dpm++"
    steps: Annotated[int, Field(ge=1, le=1000)] = 10
    contacts: Path | None = None
    configuration: Literal["capture", "paper"] = "capture"
    weights: Path | None = None
    body: Path | None = None
    height: Annotated[float, Field(ge=0.8, le=2.6)] | None = None
    stood: tuple[FiniteFloat, FiniteFloat] | Literal["phone"] | None = None
    floor: float | None = None
    up: tuple[float, float, float] | Top | None = None
    format: str | None = None
    stitch: bool = False
    closure: bool = False
    mesh_scale: Annotated[float, Field(ge=1e-6)] = 1.0
    segment: Annotated[int, Field(ge=1)] | None = None
    video_size: _Size | None = (960, 540)
    replace: bool = False
    force: bool = False


class ResolveOrder(Order):
    """A result with corrected contacts becomes another one."""

    KIND: ClassVar[str] = "resolve"
    READS: ClassVar[tuple[str, ...]] = ("result", "contacts")

    result: Path
    contacts: Path
    video_size: _Size | None = (960, 540)
    replace: bool = False


class RenderOrder(Order):
    """A result becomes a video or a picture; the ending of the output decides."""

    KIND: ClassVar[str] = "render"
    READS: ClassVar[tuple[str, ...]] = ("result",)

    result: Path
    view: Literal["third", "orbit", "follow", "top", "object"] = "third"
    sample: Annotated[int, Field(ge=1)] | None = None
    size: _Size = (960, 540)
    still: float | None = None
    sheet: tuple[Annotated[int, Field(ge=1, le=20)], Annotated[int, Field(ge=1, le=20)]] | None = (
        None
    )
    markers: bool = True
    smooth: bool | None = None


class ExportOrder(Order):
    """A result becomes a file of another program."""

    KIND: ClassVar[str] = "export"
    READS: ClassVar[tuple[str, ...]] = ("result", "skeleton")

    result: Path
    to: Literal["glb", "bvh", "usd", "fbx", "amass", "csv"]
    sample: Annotated[int, Field(ge=1)] | None = None
    fps: Literal[24, 25, 30, 60] = 30
    up: Literal["y", "z"] | None = None
    units: Literal["m", "cm"] | None = None
    bones: str = "smplx"
    skeleton: Path | None = None


class CompareOrder(Order):
    """Several motions side by side in one video or picture."""

    KIND: ClassVar[str] = "compare"

    motions: Annotated[tuple[str, ...], Field(min_length=1, max_length=25)]
    """Result folders, RESULT#3 for the third sample, or recorded clips."""
    samples: bool = False
    rule: Literal["paper"] | None = None
    heat: bool = False
    any_object: bool = False
    labels: tuple[str, ...] = ()
    size: _Size = (480, 360)
    columns: Annotated[int, Field(ge=1)] | None = None
    still: float | None = None
    sheet: Annotated[int, Field(ge=1, le=24)] | None = None
    figures: Path | None = None
    """JSON file to write every figure to."""
    markers: bool = True
    smooth: bool | None = None

    @property
    def inputs(self) -> dict[str, Path]:
        """The motions, numbered from 1."""
        paths = enumerate(self.motions, 1)
        return {f"motion {k}": Path(text.rpartition("#")[0] or text) for k, text in paths}


class OverlayOrder(Order):
    """A result drawn into a film of the take; mirrors `capture_app.overlay.write.OverlayRequest`."""

    KIND: ClassVar[str] = "overlay"
    READS: ClassVar[tuple[str, ...]] = (
        "result", "video", "camera", "board_place", "scan", "scan_images", "model_to_object"
    )  # fmt: skip

    result: Path
    video: Path | None = None
    """A film, or the session of a second phone; None for the clamped phone's own."""
    camera: Path | None = None
    board: str | None = None
    in_room: bool = False
    board_place: Path | None = None
    shared_world: bool = False
    scan: Path | None = None
    scan_images: Path | None = None
    model_to_object: Path | None = None
    scanned_at: float = 0.0
    offset: float | None = None
    thing: Literal["outline", "drawn", "hidden"] = "outline"
    opacity: Annotated[float, Field(ge=0, le=1)] = 1.0
    wipe: bool = False
    sample: Annotated[int, Field(ge=1)] | None = None
    smooth: bool = False


class ThingOrder(Order):
    """Something for the library: its output is the folder of a thing, see `capture_app.things`."""

    facts: dict[str, Any] = {}
    """To be noted of it beside what is found out."""


class CalibrateOrder(ThingOrder):
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


class ScanOrder(ThingOrder):
    """A film of an object, photos, or another app's mesh become an object; mirrors `ScanRequest`."""

    KIND: ClassVar[str] = "scan"
    READS: ClassVar[tuple[str, ...]] = ("source", "images")

    source: Path
    images: Path | None = None
    format: str | None = None
    frames: Annotated[int, Field(ge=12, le=400)] = 80
    height: Annotated[float, Field(gt=0)] | None = None
    board: str | None = None
    poses: bool = True
    camera_axes: str = "logged"
    metric: bool = False
    box: tuple[float, float, float, float, float, float] | None = None
    """Lowest and highest corner, metres, in the scan's world."""
    method: Literal["auto", "stereo", "depth", "both"] = "auto"
    vertices: Annotated[int, Field(ge=500, le=100_000)] = 10_000
    unit: Literal["m", "cm", "mm", "in", "ft"] | None = None
    object_name: str | None = None
