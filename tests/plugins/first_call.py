"""The type checker of the tests: beartype, which reads a function's types when it is first called."""

import functools
from collections.abc import Callable
from typing import Any

from beartype import beartype


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that checks the types of each of its calls.

    Reading the types of all functions of the program takes half of the time that a process of the tests
    needs to start, and most of them are never called in it.
    """
    checking: Callable[..., Any] | None = None

    @functools.wraps(function)
    def call(*positional: Any, **named: Any) -> Any:
        nonlocal checking
        if checking is None:
            checking = beartype(function)
        return checking(*positional, **named)

    return call
