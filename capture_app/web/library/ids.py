"""Names of things in the library that are safe to build a path from."""

import secrets
from typing import Annotated

from pydantic import StringConstraints

PATTERN = r"^[0-9a-f]{16}$"

Id = Annotated[str, StringConstraints(pattern=PATTERN)]
"""Sixteen hex digits that the server made; the only thing a client says that enters a path."""


def new_id() -> str:
    """One that nobody can guess, nor meet again."""
    return secrets.token_hex(8)
