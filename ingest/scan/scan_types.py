"""What travels between the stages of a scan. World: z up, metres; cameras have OpenCV's axes."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt8

from ingest.report.take_report import Check
from omomo_core.motion import Texture

Colours = UInt8[np.ndarray, "height width 3"]
"""Red, green, blue."""
Grey = UInt8[np.ndarray, "height width"]
Kind = Literal["session", "photos", "video", "colmap"]
Progress = Callable[[str, float], None]
"""Told the name of a stage and how much of it is done, 0 to 1."""


def no_progress(stage: str, done: float) -> None:
    """Progress callback that does nothing."""


@runtime_checkable
class Pictures(Protocol):
    """Pictures that are decoded when they are asked for, so that a long film fits the memory."""

    @property
    def names(self) -> Sequence[str]:
        """Names of all pictures in their order, each unique."""
        ...

    def greys(self, wanted: Sequence[int], width: int) -> Iterator[tuple[int, Grey]]:
        """Some of them, no wider than `width` pixels, in rising order; the damaged are left out."""
        ...

    def colours(self, wanted: Sequence[int]) -> Iterator[tuple[int, Colours]]:
        """Some of them as they are; otherwise the same."""
        ...


@dataclass(frozen=True)
class ScanSource:
    """What somebody gave to make a mesh of: pictures, and what is known about them."""

    kind: Kind
    where: Path
    """Path as it was given, for messages."""
    pictures: Pictures
    image_size: tuple[int, int] | None = None
    """Width and height that `intrinsics` refer to; the pictures may be smaller."""
    intrinsics: Float64[np.ndarray, "pictures 4"] | None = None
    """fx, fy, cx, cy (pixel centres at whole numbers); None where they are not known."""
    focal_guess: Float64[np.ndarray, " pictures"] | None = None
    """In lengths of each picture's longer side, NaN where not known; where there are no intrinsics."""
    T_world_camera: Float64[np.ndarray, "pictures 4 4"] | None = None
    """What the phone logged, metres and z up; NaN where it did not know."""
    upright: bool = True
    """Whether z is really up in `T_world_camera`."""
    times: Float64[np.ndarray, " pictures"] | None = None
    """Seconds."""
    depth: Callable[[int], Float32[np.ndarray, "height width"] | None] | None = None
    """Metres along the viewing direction by picture, 0 where not sure; the picture, smaller."""
    model: Path | None = None
    """Folder of a finished COLMAP model, whose pictures these are."""


@dataclass(frozen=True)
class Frame:
    """One of the pictures that the scan is made of, in the work folder."""

    name: str
    """Name of its file; COLMAP knows it by this."""
    file: Path
    size: tuple[int, int]
    """Width and height, pixels."""
    intrinsics: Float64[np.ndarray, "4"] | None = None
    """fx, fy, cx, cy of this picture."""
    T_world_camera: Float64[np.ndarray, "4 4"] | None = None
    depth: Path | None = None
    """16-bit PNG in millimetres, of `ingest.formats.still_images`; the picture, smaller."""
    focal_guess: float | None = None
    """Guess of the focal length, as in `ScanSource`."""


@dataclass(frozen=True)
class Frames:
    """The pictures that were picked, and how."""

    frames: tuple[Frame, ...]
    seen: int
    """How many pictures there were."""
    blurred: int
    """How many of them were left out because they are not sharp."""
    notes: tuple[Check, ...] = ()


@dataclass(frozen=True)
class View:
    """A registered picture: a pinhole, its lens undone."""

    name: str
    file: Path
    size: tuple[int, int]
    intrinsics: Float64[np.ndarray, "4"]
    """fx, fy, cx, cy (pixel centres at whole numbers)."""
    T_world_camera: Float64[np.ndarray, "4 4"]
    depth: Path | None = None
    """Depth map as in `Frame`; scale its intrinsics by its width over the picture's."""


@dataclass(frozen=True)
class Scale:
    """How long a metre is, and how sure that is."""

    sigma: float
    """One standard deviation, as a part."""
    by: Literal["arkit", "depth", "board", "length", "given", "height"]
    """"height": not known before the object is cut out; it is to be scaled to its height then."""
    description: str
    """Description for people, e.g. "the phone's poses (78 pictures)"."""


@dataclass(frozen=True)
class LeftOut:
    """A picture that could not be registered."""

    name: str
    reason: str


@dataclass(frozen=True)
class Registered:
    """The poses of the cameras in the world: z up, metres."""

    views: tuple[View, ...]
    points: Float64[np.ndarray, "points 3"]
    """Sparse points on object and room."""
    colours: UInt8[np.ndarray, "points 3"]
    observed: Int64[np.ndarray, "observations 2"]
    """Point, and view that shows it."""
    reprojection: float
    """Pixels between features and points, mean."""
    scale: Scale
    up: Literal["arkit", "board", "floor", "cameras", "given"]
    """What says where up is; "cameras" is a guess of a few degrees, "given" somebody's word."""
    left_out: tuple[LeftOut, ...]
    notes: tuple[Check, ...]
    model: Path
    """COLMAP model of the same pictures, in the same world, for `omocap calibrate scan`."""
    images: Path
    """Folder of its pictures."""


@dataclass(frozen=True)
class Region:
    """The object's region: above its floor, within a box that stands on it."""

    T_world_floor: Float64[np.ndarray, "4 4"]
    """Floor frame: z is the floor's normal, z = 0 the floor."""
    low: Float64[np.ndarray, "3"]
    """Lowest corner of the box in the floor's frame, metres."""
    high: Float64[np.ndarray, "3"]
    notes: tuple[Check, ...] = ()


@dataclass(frozen=True)
class ScanMesh:
    """A surface with its colours, metres."""

    vertices: Float64[np.ndarray, "vertices 3"]
    faces: Int64[np.ndarray, "faces 3"]
    colours: UInt8[np.ndarray, "vertices 3"] | None
    name: str
    notes: tuple[Check, ...] = ()
    texture: Texture | None = None
    """Painted from the pictures, in the place of colours where a file can hold one."""
