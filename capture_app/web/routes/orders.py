"""What a client may order: the requests of POST /api/jobs, with ids of the library where jobs have paths."""

import json
import re
from collections.abc import Callable, Collection
from copy import copy
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import BaseModel, Discriminator, Field, Tag, create_model
from pydantic.fields import FieldInfo

from capture_app.commands.calibrate import BoardWay, FloorWay, ScanWay, SessionWay, TrackerWay, Way
from capture_app.commands.export import FORMAT_WORDS, ExportFormat, ExportRequest
from capture_app.commands.inputs import (
    PLACE_EXAMPLE,
    DescribedModel,
    FromLibrary,
    Inline,
    OptionGroup,
    Sample,
    Which,
    with_example,
)
from capture_app.commands.overlay import OverlayRequest
from capture_app.commands.render import RenderOptions
from capture_app.commands.run import DRAW, TakeOptions
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
    if source is None and _is_path(field):
        return {}
    taken = copy(field)
    text = _OPTION.sub("", field.description or "")
    if source is None:
        taken.description = text
        return {name: (field.annotation, taken)}
    taken.metadata = []
    if isinstance(source, FromLibrary):
        kind: Any = Id
        taken.description = f"{text} The id of this in the library ({' or '.join(source.kinds)})."
    else:
        kind = source.value
        taken.description = f"{text} The content as JSON, not a file."
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


_OPTION = re.compile("--(?=[a-z])")
"""What makes a field's name an option of the command line."""
_ID = "0123456789abcdef"


class Calibration(DescribedModel):
    """What a calibration by any method needs."""

    kind: Which[Literal["calibrate"]]
    name: Name
    """What to call the mount."""
    object: Id
    """Id of the object that the phone was clamped to."""


_SCALE = ("mesh_scale",)
"""The library knows it."""


@by_id(BoardWay, leave_out=_SCALE)
class ByBoard(Calibration):
    """A second camera watched a printed board on the object while the clamped phone logged."""

    model_config = with_example(
        kind="calibrate", method="board", name="clamp", object=_ID, session=_ID, film=_ID,
        board="A4", place=PLACE_EXAMPLE,
    )  # fmt: skip

    method: Which[Literal["board"]]


@by_id(SessionWay, leave_out=_SCALE)
class BySession(Calibration):
    """The object filmed or scanned, then the phone clamped to it, in one recording.

    Where the object stood is said in exactly one way: `scan`, `object_pose`, or `board` with `place`.
    """

    model_config = with_example(
        kind="calibrate", method="session", name="clamp", object=_ID, session=_ID, scan=_ID
    )

    method: Which[Literal["session"]]


@by_id(ScanWay, leave_out=_SCALE)
class ByScan(Calibration):
    """What the clamped phone saw at rest, found again in the scan of the object."""

    model_config = with_example(
        kind="calibrate", method="scan", name="clamp", object=_ID, session=_ID
    )

    method: Which[Literal["scan"]]
    model: Id | None = None
    """Id of a COLMAP model of the scan (material); that of the object's own scan if not given."""


@by_id(TrackerWay, leave_out=_SCALE)
class ByTracker(Calibration):
    """Motion capture or a tracker followed the object while the clamped phone logged."""

    model_config = with_example(
        kind="calibrate", method="tracker", name="clamp", object=_ID, session=_ID, poses=_ID
    )

    method: Which[Literal["tracker"]]


@by_id(FloorWay, leave_out=_SCALE)
class ByFloor(Calibration):
    """A mount made surer by a recording in which the object stands on the floor."""

    model_config = with_example(
        kind="calibrate", method="floor", name="clamp", object=_ID, mount=_ID, session=_ID
    )

    method: Which[Literal["floor"]]


WAYS: dict[type[Calibration], type[Way]] = {
    ByBoard: BoardWay,
    BySession: SessionWay,
    ByScan: ScanWay,
    ByTracker: TrackerWay,
    ByFloor: FloorWay,
}
"""The way that each becomes once paths have taken the place of ids."""


_Size = tuple[Annotated[int, Field(ge=64, le=3840)], Annotated[int, Field(ge=64, le=2160)]]


class RunOptions(TakeOptions):
    """How to make a motion; see `omocap run --help`."""

    model_config = with_example(samples=4, seed=0, height=1.72, up="object:z", floor=-0.8)

    video: Annotated[bool, OptionGroup.RESULT, Field(title="Draw a video", description=DRAW)] = True


class Run(DescribedModel):
    """A take becomes a motion."""

    model_config = with_example(kind="run", session=_ID, object=_ID, mount=_ID, options={"seed": 1})

    kind: Which[Literal["run"]]
    name: Name | None = None
    """What to call the result; as the session if not given."""
    session: Id
    """Id of the recording."""
    object: Id | None = None
    """Id of the object. A phone's log needs it; not given, the object's own motion has its mesh."""
    mount: MountChoice | None = None
    """Id of the mount, or "identity" where the mesh is in the phone's own frame. A phone's log needs one
    or the other; it is not given for an object's own motion."""
    contacts: Id | None = None
    """Id of a list of contacts: which hand holds the object when and where. The program decides if not
    given."""
    options: RunOptions = RunOptions()
    """How to make the motion."""


_CONTACTS = {
    "version": 1,
    "fps": 30,
    "frames": 240,
    "segments": [{"hand": "left", "start": 12, "stop": 96, "anchor": [0.2, 0.0, 0.4]}],
}


class OtherContacts(DescribedModel):
    """Other contacts of a sample, each with the place on the object that the hand holds."""

    model_config = with_example(contacts=_CONTACTS)

    contacts: dict[str, Any]
    """The whole of contacts.json, as corrected."""
    sample: Sample = None


class Resolve(OtherContacts):
    """A result with corrected contacts becomes another one."""

    model_config = with_example(kind="resolve", result=_ID, contacts=_CONTACTS)

    kind: Which[Literal["resolve"]]
    name: Name | None = None
    """What to call the new result; as the old one, with the word corrected, if not given."""
    result: Id
    """Id of the result that was corrected."""
    video: Annotated[bool, Field(title="Draw a video", description=DRAW)] = True


@by_id(ExportRequest, leave_out=("name", "output", "blender", "robot", "frames", "reduce_keys"))
class Export(DescribedModel):
    """A result becomes a file of another program."""

    model_config = with_example(kind="export", result=_ID, to="glb", bones="unreal", fps=60)

    kind: Which[Literal["export"]]
    result: Id
    """Id of the result."""
    to: Annotated[ExportFormat, FORMAT_WORDS, Field(title="Format")]
    """Format of the file; dae and robot are refused with a reason."""


class Render(RenderOptions):
    """A result becomes a video."""

    model_config = with_example(kind="render", result=_ID, view="orbit", size=[960, 540])

    kind: Which[Literal["render"]]
    result: Annotated[Id, Field(description="Id of the result.")]
    size: Annotated[_Size, Field(description="Width and height of the pictures in pixels.")] = (
        960,
        540,
    )
    """At most what others who wait can bear."""


class Compare(DescribedModel):
    """Several results side by side in one video."""

    model_config = with_example(kind="compare", results=[_ID, "fedcba9876543210"])

    kind: Which[Literal["compare"]]
    results: Annotated[list[Id], Field(min_length=1, max_length=25)]
    """Ids of the results, in the order in which they are shown."""
    samples: bool = False
    """All samples of each, not only the chosen one."""


@by_id(OverlayRequest, leave_out=("name", "output", "result", "backend"))
class Overlay(DescribedModel):
    """A result drawn into a film of the take.

    Without `video` the clamped phone's own film. Where its camera stood is told by `board`, by
    `camera` with T_world_camera, by `scan`, or, for a second phone, by `shared_world`.
    """

    model_config = with_example(kind="overlay", result=_ID, video=_ID, board="A4")

    kind: Which[Literal["overlay"]]
    result: Id
    """Id of the result."""


@by_id(ScanRequest, leave_out=("output", "facts", "keep", "replace"))
class Scan(DescribedModel):
    """A film or photos of an object, or a mesh of another app, become an object of the library."""

    model_config = with_example(kind="scan", name="chair", source=_ID, height=0.95)

    kind: Which[Literal["scan"]]
    name: Name
    """What to call the object."""
    room: Literal["app"] | None = None
    """Use the room's mesh that the phone's app exported into the session; not used if not given."""


def _tag(given: Any) -> str:
    """Return which of the orders it is: by its kind, and a calibration by its method too."""
    said = given if isinstance(given, dict) else getattr(given, "__dict__", {})
    kind = said.get("kind")
    return f"{kind} by {said.get('method')}" if kind == "calibrate" else str(kind)


# A discriminator inside of another one is nothing that OpenAPI can describe.
_AnyOrder = (
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
    | Annotated[ByFloor, Tag("calibrate by floor")]
)
_TAGS = [mark.tag for order in get_args(_AnyOrder) for mark in order.__metadata__]
Ordered = Annotated[
    _AnyOrder,
    Discriminator(
        _tag,
        custom_error_type="order_unknown",
        custom_error_message="the kind, with the method of a calibration, is none of these: "
        + ", ".join(_TAGS),
    ),
]
"""What POST /api/jobs takes."""
