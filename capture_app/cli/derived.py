"""derived: the options of a command, made from the model of what it asks for."""

import inspect
from collections.abc import Callable, Collection, Sequence
from typing import Annotated, Any, Literal, get_origin

import annotated_types
import typer
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from capture_app.commands.inputs import Positional, group_of, option_of, typed_as


def derived(
    model: type[BaseModel],
    *,
    first: Sequence[str] = (),
    leave_out: Collection[str] = (),
    only: Collection[str] | None = None,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command an option for each described field of a model.

    The command takes them as `**said`, or by name where it needs one in particular.
    Texts, bounds, defaults and choices are the model's. What is no plain type is typed as text, and the
    model parses it.

    Args:
        model: with a description for each field that the command line offers.
        first: fields whose options the help lists before the others of their group.
        leave_out: fields that the command spells itself or does not offer.
        only: the fields to take; all that are described if None.
    """

    ordered = {name: model.model_fields[name] for name in first} | model.model_fields

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        made = {
            name: _parameter(name, field)
            for name, field in ordered.items()
            if field.description and name not in leave_out and (only is None or name in only)
        }
        own = [
            parameter
            for parameter in inspect.signature(command).parameters.values()
            if parameter.kind is not inspect.Parameter.VAR_KEYWORD and parameter.name not in made
        ]
        parameters = [*own, *made.values()]
        command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        command.__annotations__ = {p.name: p.annotation for p in parameters}
        return command

    return decorate


def _parameter(name: str, field: FieldInfo) -> inspect.Parameter:
    if any(isinstance(mark, Positional) for mark in field.metadata):
        return _argument(name, field)
    flag = option_of(name, field)
    kind = typed_as(field.annotation)
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
        rich_help_panel=group_of(field),
    )
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=default,
        annotation=Annotated[kind, option],
    )


def _argument(name: str, field: FieldInfo) -> inspect.Parameter:
    """An argument that must be given."""
    argument = typer.Argument(help=field.description, show_default=False)
    kind = Annotated[typed_as(field.annotation), argument]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=kind)


def _text(default: Any, kind: Any) -> Any:
    """The default as it is typed: a size as 960x540, a number of a choice as text."""
    if isinstance(default, tuple):
        return "x".join(map(str, default)) if default else []
    return str(default) if get_origin(kind) is Literal else default
