"""What pydantic found wrong, in the words of our errors."""

from collections.abc import Sequence
from typing import Any


def first_problem(errors: Sequence[Any]) -> tuple[str, str]:
    """The first wrong field by its dotted path, and what is wrong with it.

    Args:
        errors: as a ValidationError of pydantic lists them.
    """
    first = errors[0]
    # Before what our own validators say, pydantic puts the kind of the exception.
    return ".".join(map(str, first["loc"])), first["msg"].removeprefix("Value error, ")
