"""derived: the options of a command, made from the model of what it asks for."""

import inspect
import types
from collections.abc import Callable, Collection
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import annotated_types
import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from capture_app.commands.inputs import Flag

_PLAIN = (int, float, bool, str, Path)


def derived(
    model: type[BaseModel], *, leave_out: Collection[str] = (), only: Collection[str] | None = None
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command, which takes `**said`, an option for each described field of a model.

    Texts, bounds, defaults and choices are the model's. What is no plain type is typed as text, and the
    model parses it.

    Args:
        model: with a description for each field that the command line offers.
        leave_out: fields that the command spells itself or does not offer.
        only: the fields to take; all that are described if None.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        own = [
            parameter
            for parameter in inspect.signature(command).parameters.values()
            if parameter.kind is not inspect.Parameter.VAR_KEYWORD
        ]
        made = [
            _parameter(name, field)
            for name, field in model.model_fields.items()
            if field.description and name not in leave_out and (only is None or name in only)
        ]
        command.__signature__ = inspect.Signature([*own, *made])  # type: ignore[attr-defined]
        command.__annotations__ = {p.name: p.annotation for p in (*own, *made)}
        return command

    return decorate


def _parameter(name: str, field: FieldInfo) -> inspect.Parameter:
    flags = [mark.name for mark in field.metadata if isinstance(mark, Flag)]
    flag = flags[0] if flags else f"--{name.replace('_', '-')}"
    kind = _typed(field.annotation)
    if field.default is True or kind == bool | None:
        flag = f"{flag}/--no-{flag[2:]}"
    least: Any = next((m.ge for m in field.metadata if isinstance(m, annotated_types.Ge)), None)
    most: Any = next((m.le for m in field.metadata if isinstance(m, annotated_types.Le)), None)
    default = inspect.Parameter.empty if field.is_required() else _text(field.default, kind)
    option = typer.Option(
        flag,
        help=field.description,
        show_default=default not in (None, False, "", [], inspect.Parameter.empty),
        min=least,
        max=most,
    )
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=default,
        annotation=Annotated[kind, option],
    )


def _typed(annotation: Any) -> Any:
    """The type that typer parses: the field's own if it is plain, texts for a list, else text."""
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


def _text(default: Any, kind: Any) -> Any:
    """The default as it is typed: a size as 960x540, a number of a choice as text."""
    if isinstance(default, tuple):
        return "x".join(map(str, default)) if default else []
    return str(default) if get_origin(kind) is Literal else default
