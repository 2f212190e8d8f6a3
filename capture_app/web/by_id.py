"""Requests whose inputs are named by ids of the library: their models, and how paths take the ids' place."""

import json
from collections.abc import Callable, Collection
from copy import copy
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, create_model
from pydantic.fields import FieldInfo

from capture_app.commands.inputs import FromLibrary, Inline
from capture_app.web.library.ids import Id
from capture_app.web.library.library import Library

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
