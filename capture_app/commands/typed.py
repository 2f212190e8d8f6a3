"""typed_as: how a field of a request is typed, on a command line or in the query of an address."""

import types
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

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
