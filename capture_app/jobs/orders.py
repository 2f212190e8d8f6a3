"""What can be ordered: one model for each kind of job, with plain paths."""

from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from capture_app.calibration.ways.requests import AnyWay
from capture_app.commands.request import Request


class ExportOrder(Request):
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


class OverlayOrder(Request):
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


class ThingOrder(Request):
    """Something for the library: its output is the folder of a thing, see `capture_app.things`."""

    facts: Annotated[dict[str, Any], Field(default_factory=dict)]
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
