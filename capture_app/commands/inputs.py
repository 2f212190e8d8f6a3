"""Inputs of a request: how they are named (a path here, an id of the library on a server) and typed."""

import types
from dataclasses import dataclass
from enum import Enum, StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

if TYPE_CHECKING:
    from omomo_core.motion import ObjectMesh

Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
ShortText = Annotated[str, Field(max_length=200)]
Point = tuple[Number, Number, Number]
_Row = tuple[Number, Number, Number, Number]
Matrix = tuple[_Row, _Row, _Row, _Row]
"""A pose, row by row; a similarity where its rotation may be scaled."""

_T = TypeVar("_T")

PLACE_EXAMPLE = {
    "points": [
        {"board_mm": [0, 0], "object": [0.17, -0.06, 0.13]},
        {"board_mm": [175, 0], "object": [0.17, 0.12, 0.12]},
        {"board_mm": [175, 245], "object": [0.17, 0.1, -0.13]},
    ]
}


class DescribedModel(BaseModel):
    """A model in whose schema the text below a field is the field's description."""

    model_config = ConfigDict(use_attribute_docstrings=True)


Which = Annotated[_T, Field(description="Says which of the alternatives this is.")]
"""The type of a field by which the members of a union are told apart: `Which[Literal["run"]]`."""


def with_example(**example: Any) -> ConfigDict:
    """Return the configuration of a model of HTTP that has this example."""
    return ConfigDict(
        extra="forbid", allow_inf_nan=False, json_schema_extra={"examples": [example]}
    )


class PlacePoint(DescribedModel):
    """A point of a printed board, and where it is on the object."""

    model_config = with_example(**PLACE_EXAMPLE["points"][0])

    board_mm: tuple[Number, Number]
    """x and y on the print in millimetres, from the corner where the arrows start."""
    object: Point
    """Metres in the object's frame."""


class BoardPlacement(DescribedModel):
    """The place of a board on the object."""

    model_config = with_example(**PLACE_EXAMPLE)

    points: Annotated[list[PlacePoint], Field(min_length=3, max_length=200)]
    """Points that do not lie on one line."""
    sigma_mm: Annotated[float, Field(gt=0, le=100)] = 2.0
    """How far the places on the object are off, one sigma, millimetres."""


class CameraIntrinsics(DescribedModel):
    """The intrinsics of a camera, in pixels of its pictures, and its pose where that is known."""

    model_config = with_example(fx=1430, fy=1430, cx=960, cy=540, width=1920, height=1080)

    fx: Annotated[float, Field(gt=0, le=1e6)]
    """Focal length along x, pixels."""
    fy: Annotated[float, Field(gt=0, le=1e6)]
    """Focal length along y, pixels."""
    cx: Number
    """Principal point from the left edge, pixels."""
    cy: Number
    """Principal point from the top edge, pixels."""
    distortion: Annotated[list[Number], Field(max_length=14)] = []
    """OpenCV's k1 k2 p1 p2 k3 ...; none if empty."""
    width: Annotated[int, Field(ge=16, le=16384)]
    """Width of its pictures, pixels."""
    height: Annotated[int, Field(ge=16, le=16384)]
    """Height of its pictures, pixels."""
    T_world_camera: Matrix | None = None
    """Its pose in the world of a result, row by row, metres: x right, y down, z ahead. Needed in an overlay
    without a board, if not given elsewhere."""


LOG = "What the phone's logger wrote: folder, pose file or archive."
"""Description of a session, for fields and arguments."""

ItemKind = Literal["session", "object", "mount", "video", "contacts", "material"]
"""What can be in the library of the page."""


def shown(unit: str = "", words: str = "") -> Any:
    """Mark a field with what a form shows of it.

    Args:
        unit: behind the label.
        words: what its values are called, as "value: word; value: word"; ": word" where none is chosen.
    """
    named: Any = dict(pair.split(": ") for pair in words.split("; ") if words)
    return Field(json_schema_extra={"unit": unit} if unit else {"words": named})


class OptionGroup(StrEnum):
    """Marks a field with the group in which the help of the command line lists its option."""

    MAIN = "Options"
    """What most people need, and every field without a mark."""
    READING = "Reading the inputs"
    PERSON = "What is known of the person"
    MOTION = "Making the motion"
    RESULT = "Result and video"
    MACHINES = "Queue and workers"


def group_of(field: FieldInfo) -> OptionGroup:
    """The group of a field's option."""
    marks = (mark for mark in field.metadata if isinstance(mark, OptionGroup))
    return next(marks, OptionGroup.MAIN)


def option_of(name: str, field: FieldInfo) -> str:
    """The option of the command line for a field, such as "--mesh-scale"."""
    marks = [mark.name for mark in field.metadata if isinstance(mark, OptionName)]
    return marks[0] if marks else f"--{name.replace('_', '-')}"


@dataclass(frozen=True)
class OptionName:
    """Marks a field whose command-line option has another name than the field."""

    name: str


@dataclass(frozen=True)
class Positional:
    """Marks a field that the command line takes as an argument, without the name of an option."""


@dataclass(frozen=True)
class FromLibrary:
    """Marks a path that a client of the page names by the id of something in the library."""

    kinds: tuple[ItemKind, ...]
    """What it may be; what is dropped becomes the first."""
    drop: tuple[str, str] = ("", "")
    """Title and text of the area where it can be dropped."""
    accept: str = ""
    """Endings of a file that can be dropped there, by commas; a folder if empty."""


@dataclass(frozen=True)
class Inline:
    """Marks a path to a small file that a client of the page sends as a JSON value instead."""

    value: Any
    """Type of the value: a model, or Matrix."""
    file: str
    """Name of the file that is written from it."""
    name: str | None = None
    """Name of the field over HTTP, where it is another one."""


LogFormat = Annotated[
    str | None,
    shown(words=": found by what it holds"),
    Field(
        title="Recorded with",
        max_length=100,
        description="Read the log as that of this app (a name that `omocap formats` lists), "
        "whatever it looks like; told by what it holds if not given.",
    ),
]
Sample = Annotated[
    int | None,
    Field(ge=1, le=64, description="Which sample, from 1; the chosen one if not given."),
]


_PLAIN = (int, float, bool, str, Path)


def typed_as(annotation: Any) -> Any:
    """Return what a field is typed as: its own type if that is plain, texts for a list, else text."""
    members = _members(annotation)
    parts = [part for part in members if part is not types.NoneType]
    kind: Any = parts[0] if len(parts) == 1 else str
    if get_origin(kind) is tuple and get_args(kind)[-1] is Ellipsis:
        return list[str]
    if get_origin(kind) is Literal:
        kind = Literal[tuple(map(str, get_args(kind)))]
    elif kind not in _PLAIN and not (isinstance(kind, type) and issubclass(kind, Enum)):
        kind = str
    return kind | None if len(parts) < len(members) else kind


def _members(annotation: Any) -> list[Any]:
    """The members of a union, without what annotates them."""
    if get_origin(annotation) is Annotated:
        return _members(get_args(annotation)[0])
    if get_origin(annotation) in (Union, types.UnionType):
        return [part for member in get_args(annotation) for part in _members(member)]
    return [annotation]


@dataclass(frozen=True)
class MeshFile:
    """An object's mesh."""

    path: Path
    scale: float = 1.0
    """Factor that brings it to metres."""

    def load(self, factor: float = 1.0) -> "ObjectMesh":
        """The mesh in metres.

        Args:
            factor: what a mount says that it must be multiplied by beside.

        Raises:
            InputError: as `load_mesh`.
        """
        from ingest.mesh import load_mesh

        return load_mesh(self.path, scale=self.scale * factor)
