"""The answer key: what stood where on which page. It stays with who makes the study."""

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from capture_app.study.design import Side
from capture_app.validation import first_problem
from omomo_core.errors import InputError

KEY, PAGES = "key.json", "pages"
"""The key, and the folder of what raters get, in a study's folder."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class KeyItem(_Record):
    """One question as one page shows it."""

    id: str
    """What the page calls it; tells a rater nothing."""
    take: str
    left: str
    """Name of the method on the left."""
    right: str
    intact: Side | None = None
    """In an attention check, the side that was not broken."""


class KeyPage(_Record):
    """One page."""

    id: str
    file: str
    batch: int
    items: tuple[KeyItem, ...]


class Key(_Record):
    """`key.json` of a study's folder."""

    format_version: Literal[1] = 1
    study: str
    """What the pages and votes of this study call it."""
    seed: int
    methods: tuple[str, ...]
    pages: tuple[KeyPage, ...]


def write_key(folder: Path, key: Key) -> None:
    """Write it into a study's folder."""
    (folder / KEY).write_text(key.model_dump_json(indent=1) + "\n", encoding="utf-8")


def read_key(folder: Path) -> Key:
    """Read what `write_key` wrote.

    Raises:
        InputError: there is none, or it is damaged.
    """
    path = folder / KEY
    try:
        return Key.model_validate_json(path.read_bytes())
    except OSError as error:
        raise InputError(
            "study-missing",
            "This is no study: it has no answer key.",
            where=str(path),
            fix="Give the folder that `omocap study make` wrote, with its key.json.",
        ) from error
    except ValidationError as error:
        field, problem = first_problem(error.errors())
        raise InputError(
            "study-damaged",
            f"The answer key cannot be read: {field}: {problem}.",
            where=str(path),
            fix="Make the study again with the same seed: its key will be the same.",
        ) from error
