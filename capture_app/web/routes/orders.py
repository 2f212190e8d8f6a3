"""What a client may order: the requests of POST /api/jobs, with ids of the library where jobs have paths."""

import json
from collections.abc import Callable, Collection
from copy import copy
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, Discriminator, Field, Tag, create_model
from pydantic.fields import FieldInfo

from capture_app.commands.calibrate import BoardWay, FloorWay, ScanWay, SessionWay, TrackerWay, Way
from capture_app.commands.export import ExportFormat, ExportRequest
from capture_app.commands.inputs import PLACE_EXAMPLE, FromLibrary, Inline, Sample, with_example
from capture_app.commands.overlay import OverlayRequest
from capture_app.commands.render import RenderOptions
from capture_app.commands.run import TakeOptions
from capture_app.commands.scan import ScanRequest
from capture_app.library_item import Name
from capture_app.web.library import Library
from capture_app.web.shelves import Id
from capture_app.web.sources import MountChoice

Model = TypeVar("Model", bound=BaseModel)


def by_id(
    request: type[BaseModel], *, leave_out: Collection[str] = ()
) -> Callable[[type[Model]], type[Model]]:
    """Give a model of HTTP the fields of a request, with ids and JSON values in place of paths.

    A path that is marked `FromLibrary` becomes an id, one that is marked `Inline` a JSON value; other paths
    are those of the server and are left out. What the model defines itself stays.

    Args:
        request: whose fields are taken, with texts, bounds and defaults.
        leave_out: fields that clients shall not say.
    """

    def extend(model: type[Model]) -> type[Model]:
        fields: dict[str, Any] = {}
        for name, field in request.model_fields.items():
            if name not in model.model_fields and name not in leave_out:
                fields |= _client_field(name, field)
        return create_model(
            model.__name__,
            __base__=model,
            __doc__=model.__doc__,
            __module__=model.__module__,
            **fields,
        )

    return extend


def with_paths(
    library: Library, id_: str, given: BaseModel, request: type[BaseModel]
) -> dict[str, Any]:
    """Return the fields of a request as a client said them, with paths in place of ids and JSON values.

    Args:
        library: where the ids are looked up.
        id_: of the job, for the files that are written from JSON values.
        given: a model made with `by_id`.
        request: the model that it was made from.

    Raises:
        Refused: 404 when something that is named is not there.
    """
    said: dict[str, Any] = {}
    for name, field in request.model_fields.items():
        source = _source(field)
        value = getattr(given, _client_name(name, source), None)
        if value is None:
            continue
        if isinstance(source, FromLibrary):
            value = library.content(value, *source.kinds)
        elif isinstance(source, Inline):
            value = library.notes.write(id_, source.file, _text(value))
        said[name] = value
    return said


def _client_field(name: str, field: FieldInfo) -> dict[str, Any]:
    source = _source(field)
    if source is None:
        return {} if _is_path(field) else {name: (field.annotation, field)}
    kind: Any = Id if isinstance(source, FromLibrary) else source.value
    taken = copy(field)
    taken.metadata = []
    if not field.is_required():
        kind |= None
    return {_client_name(name, source): (kind, taken)}


def _source(field: FieldInfo) -> FromLibrary | Inline | None:
    marks = (mark for mark in field.metadata if isinstance(mark, FromLibrary | Inline))
    return next(marks, None)


def _client_name(name: str, source: FromLibrary | Inline | None) -> str:
    return source.name or name if isinstance(source, Inline) else name


def _is_path(field: FieldInfo) -> bool:
    kind: Any = field.annotation
    return kind in (Path, Path | None)


def _text(value: Any) -> str:
    """A model as JSON; a matrix row by row."""
    if isinstance(value, BaseModel):
        return json.dumps(value.model_dump(mode="json", exclude_none=True))
    return "".join(" ".join(map(repr, row)) + "\n" for row in value)


_ID = "0123456789abcdef"


class Calibration(BaseModel):
    """What a calibration by any method needs."""

    kind: Literal["calibrate"]
    name: Name
    object: Id


_SCALE = ("mesh_scale",)
"""The library knows it."""


@by_id(BoardWay, leave_out=_SCALE)
class ByBoard(Calibration):
    """A second camera watched a printed board on the object while the clamped phone logged."""

    model_config = with_example(
        kind="calibrate", method="board", name="clamp", object=_ID, session=_ID, film=_ID,
        board="A4", place=PLACE_EXAMPLE,
    )  # fmt: skip

    method: Literal["board"]


@by_id(SessionWay, leave_out=_SCALE)
class BySession(Calibration):
    """The object filmed or scanned, then the phone clamped to it, in one recording.

    Where the object stood is said in exactly one way: `scan`, `object_pose`, or `board` with `place`.
    """

    model_config = with_example(
        kind="calibrate", method="session", name="clamp", object=_ID, session=_ID, scan=_ID
    )

    method: Literal["session"]


@by_id(ScanWay, leave_out=_SCALE)
class ByScan(Calibration):
    """What the clamped phone saw at rest, found again in the scan of the object.

    Without `model` in the scan that the object was made by.
    """

    model_config = with_example(
        kind="calibrate", method="scan", name="clamp", object=_ID, session=_ID
    )

    method: Literal["scan"]


@by_id(TrackerWay, leave_out=_SCALE)
class ByTracker(Calibration):
    """Motion capture or a tracker followed the object while the clamped phone logged."""

    model_config = with_example(
        kind="calibrate", method="tracker", name="clamp", object=_ID, session=_ID, poses=_ID
    )

    method: Literal["tracker"]


@by_id(FloorWay, leave_out=_SCALE)
class ByFloor(Calibration):
    """A mount made surer by a recording in which the object stands on the floor."""

    model_config = with_example(
        kind="calibrate", method="floor", name="clamp", object=_ID, mount=_ID, session=_ID
    )

    method: Literal["floor"]


WAYS: dict[type[Calibration], type[Way]] = {
    ByBoard: BoardWay,
    BySession: SessionWay,
    ByScan: ScanWay,
    ByTracker: TrackerWay,
    ByFloor: FloorWay,
}
"""The way that each becomes once paths have taken the place of ids."""


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
    """Return which of the orders it is: by its kind, and a calibration by its method too."""
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
