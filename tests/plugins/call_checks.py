"""Checks of types and shapes at every call of the program's functions: beartype and jaxtyping, made quick.

The option `--jaxtyping-packages` puts a decorator onto each function and data class. That of jaxtyping
builds two functions for each of them and checks arguments twice a call. The one of this file checks the
same once, and reads a function's types when it is first called, which most functions never are.
"""

import functools
import inspect
from collections.abc import Callable
from dataclasses import is_dataclass
from typing import Any, get_type_hints

import jaxtyping
from jaxtyping._storage import pop_shape_memo, push_shape_memo

_jaxtyped = jaxtyping.jaxtyped
_NO_DIMENSIONS: dict[str, Any] = {}
"""Arguments that dimensions may name as `{argument}`; no shape of the program does."""


def checked(*, typechecker: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """The decorator of functions, methods and data classes."""

    def decorate(checked: Any) -> Any:
        if inspect.isclass(checked):
            if is_dataclass(checked):
                checked.__init__ = decorate(checked.__init__)
            return checked
        if isinstance(checked, (classmethod, staticmethod)):
            return type(checked)(decorate(checked.__func__))
        if not inspect.isfunction(checked) or _yields(checked):
            return _jaxtyped(checked, typechecker=typechecker)
        return _checked_function(checked, typechecker)

    return decorate


def _yields(function: Callable[..., Any]) -> bool:
    """Whether a function runs on after its call, so that dimensions of the call do not hold in it."""
    kinds = (inspect.isgeneratorfunction, inspect.iscoroutinefunction, inspect.isasyncgenfunction)
    return any(kind(function) for kind in kinds)


def _checked_function(
    function: Callable[..., Any], typechecker: Callable[[Any], Any]
) -> Callable[..., Any]:
    checking: Callable[..., Any] | None = None

    @functools.wraps(function)
    def call(*positional: Any, **named: Any) -> Any:
        nonlocal checking
        if checking is None:
            function.__annotations__ = _types(function)
            checking = typechecker(function)
        push_shape_memo(_NO_DIMENSIONS)
        try:
            return checking(*positional, **named)
        finally:
            pop_shape_memo()

    return call


def _types(function: Callable[..., Any]) -> dict[str, Any]:
    """Types of arguments and result; those that are imported for the type checker alone are left out."""
    known: dict[str, Any] = {}
    for name, annotation in function.__annotations__.items():
        alone = type("Alone", (), {"__annotations__": {name: annotation}})
        try:
            known |= get_type_hints(alone, function.__globals__, include_extras=True)
        except (NameError, AttributeError):
            continue
    return known


jaxtyping.jaxtyped = checked  # type: ignore[assignment]
