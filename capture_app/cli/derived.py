"""derived: the options of a command, made from the model of what it asks for."""

import inspect
import types
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import annotated_types
import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

_PLAIN = (int, float, bool, str, Path)
_FLAGS = {"configuration": "--config", "any_object": "--any", "figures": "--json"}
"""Fields whose option has another name."""


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
    flag = _FLAGS.get(name, f"--{name.replace('_', '-')}")
    kind = _typed(field.annotation)
    if field.default is True or kind == bool | None:
        flag = f"{flag}/--no-{flag[2:]}"
    least: Any = next((m.ge for m in field.metadata if isinstance(m, annotated_types.Ge)), None)
    most: Any = next((m.le for m in field.metadata if isinstance(m, annotated_types.Le)), None)
    default = _text(field.default)
    option = typer.Option(
        flag,
        help=field.description,
        show_default=default is not None and default is not False,
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
    """The type that typer parses: the field's own if it is plain, else text."""
    parts = [part for part in _members(annotation) if part is not types.NoneType]
    kind = parts[0] if len(parts) == 1 else str
    if kind not in _PLAIN and get_origin(kind) is not Literal:
        kind = str
    return kind | None if len(parts) < len(_members(annotation)) else kind


def _members(annotation: Any) -> list[Any]:
    """The members of a union, without what annotates them."""
    if get_origin(annotation) is Annotated:
        return _members(get_args(annotation)[0])
    if get_origin(annotation) in (Union, types.UnionType):
        return [part for member in get_args(annotation) for part in _members(member)]
    return [annotation]


def _text(default: Any) -> Any:
    """A size is shown as it is typed."""
    return "x".join(map(str, default)) if isinstance(default, tuple) else default
