"""A table of sessions: one line each, with what is particular to it."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from capture_app.commands.request import validated
from capture_app.commands.run import RunRequest, TakeOptions
from capture_app.jobs.batch.sessions import unused
from omomo_core.errors import InputError

_PATHS = ("session", "object", "mount", "contacts", "body", "weights")
_COLUMNS = tuple(name for name in RunRequest.model_fields if name not in ("output", "animated"))


def read_table(file: Path) -> list[dict[str, Any]]:
    """The lines of a CSV table: what is said in them about a run, by the names of `RunRequest`.

    The column `session` is needed, each other one may be there. Paths are relative to the table's
    folder. An empty cell says nothing. Lines without a name are named after their session.

    Raises:
        InputError: "batch-table-..."
    """
    try:
        with file.open(newline="", encoding="utf-8-sig") as text:
            reader = csv.DictReader(text)
            lines = [(reader.line_num, line) for line in reader]
            columns = list(reader.fieldnames or [])
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            "batch-table-unreadable",
            f"The table of sessions cannot be read: {error}.",
            where=str(file),
            fix="Save it as CSV in UTF-8, with commas.",
        ) from error
    _check_columns(file, columns)
    names: dict[str, Path] = {}
    return [_row(file, number, line, names) for number, line in lines]


def _check_columns(file: Path, columns: list[str]) -> None:
    unknown = [name for name in columns if name not in _COLUMNS]
    if unknown or "session" not in columns:
        raise InputError(
            "batch-table-columns",
            f"The table has columns that say nothing: {', '.join(unknown)}."
            if unknown
            else "The table has no column `session`.",
            where=f"{file}, line 1",
            fix=f"Name the columns {', '.join(_COLUMNS)}: `session`, and which else you need.",
        )


def _row(
    file: Path, number: int, line: Mapping[str | Any, Any], names: dict[str, Path]
) -> dict[str, Any]:
    if None in line or None in line.values() or not line["session"]:
        raise InputError(
            "batch-table-line",
            "The line has not as many cells as there are columns, or names no session.",
            where=f"{file}, line {number}",
            fix="Put text with a comma in it into quotation marks.",
        )
    said: dict[str, Any] = {name: cell.strip() for name, cell in line.items() if cell.strip()}
    for name in _PATHS:
        if name in said and not (name == "mount" and said[name] == "identity"):
            said[name] = file.parent / said[name]
    options = {field: said[field] for field in TakeOptions.model_fields if field in said}
    place = f"{file}, line {number}"
    said |= validated(TakeOptions, options, "batch-option", where=place).model_dump(
        exclude_unset=True
    )
    name = unused(_word(said.get("name") or said["session"].stem), names)
    names[name] = said["session"]
    return {**said, "name": name}


def _word(name: str) -> str:
    """Fit for the name of a folder."""
    word = "".join(c if c.isalnum() or c in "-_. " else "_" for c in name).strip(". ")
    return word or "session"
