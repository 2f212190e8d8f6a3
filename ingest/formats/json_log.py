"""Logs in JSON, read strictly: values, records of many frames, and where each defect is."""

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn, cast

import numpy as np
from jaxtyping import Float64

from ingest.formats.camera_poses import one_size
from ingest.formats.text_table import MAX_BYTES
from omomo_core import strict_json
from omomo_core.errors import InputError

MAX_JSON_BYTES = 64 * 2**20
"""Half an hour of 60 poses a second with their intrinsics."""

JsonObject = dict[str, object]

_KINDS = {"dict": "an object", "str": "a text", "bool": "true or false", "NoneType": "null"}
_COPY_FIX = "Compare the place with the app's own file; if that says the same, leave the entry out."


def mentions(path: Path, *keys: str) -> bool:
    """Whether a file that begins like a JSON object has all these keys somewhere; never raises.

    A cheap look for `detect`: a damaged log is still recognised, and `load_object` says what is
    wrong with it.
    """
    try:
        if not path.is_file() or path.stat().st_size > MAX_JSON_BYTES:
            return False
        with path.open("rb") as file:
            head = file.read(64)
            if not head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
                return False
            text = head + file.read()
    except OSError:
        return False
    return all(f'"{key}"'.encode() in text for key in keys)


def load_object(path: Path) -> JsonObject:
    """The JSON object that the file holds.

    Raises:
        InputError: "log-too-large", "log-truncated" when the file ends too early, "log-damaged"
            for anything else that is no JSON object, "log-not-finite" for NaN or Infinity.
    """
    if path.stat().st_size > MAX_JSON_BYTES:
        raise InputError(
            "log-too-large",
            f"{path.name} has {path.stat().st_size / 2**20:.0f} MB; this reader takes at most "
            f"{MAX_JSON_BYTES / 2**20:.0f}.",
            where=str(path),
            fix="Give the folder that the capture app wrote, or a shorter take.",
        )

    def refuse_constant(name: str) -> NoReturn:
        raise _not_finite(name, str(path))

    try:
        value = strict_json.parse(path.read_bytes(), constant=refuse_constant)
    except json.JSONDecodeError as error:
        raise _no_json(error, path) from None
    except UnicodeDecodeError:
        raise _damaged(f"{path.name} is no UTF-8 text.", str(path)) from None
    except ValueError as problem:
        raise _damaged(f"{path.name} is damaged: {problem}.", str(path)) from None
    return object_at(value, path, "")


def object_at(value: object, path: Path, where: str) -> JsonObject:
    """The value as an object; `where` says what it is, e.g. "frame 17" ("" is the whole file)."""
    if not isinstance(value, dict):
        raise _wrong(value, "an object {...}", path, where)
    return cast(JsonObject, value)


def list_at(value: object, path: Path, where: str) -> list[object]:
    """The value as a list."""
    if not isinstance(value, list):
        raise _wrong(value, "a list [...]", path, where)
    return cast(list[object], value)


def text_at(value: object, path: Path, where: str) -> str:
    """The value as a string."""
    if not isinstance(value, str):
        raise _wrong(value, "a text", path, where)
    return value


def number_at(value: object, path: Path, where: str) -> float:
    """The value as a finite number (true and "1" are none)."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(value, "a number", path, where)
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise _not_finite(str(number), place(path, where))
    return number


def numbers_at(
    value: object, shape: tuple[int | None, ...], path: Path, where: str
) -> Float64[np.ndarray, "..."]:
    """Nested lists as an array of finite numbers of the given shape.

    Args:
        value: what stands in the file.
        shape: length of each nesting; None takes any length, the same for all lists of that level.
        path: the file, for messages.
        where: what the value is, e.g. "frame 17, transform_matrix"; a bad element is named
            "poses[17][2]" after it.
    """
    lengths: list[int] = []
    level = [value]
    for wanted in shape:
        lists = [
            cast(list[object], item)
            if isinstance(item, list)
            else list_at(item, path, _element(where, i, lengths))
            for i, item in enumerate(level)
        ]
        length = wanted if wanted is not None else len(lists[0]) if lists else 0
        for i, items in enumerate(lists):
            if len(items) != length:
                raise _wrong(items, f"a list of {length}", path, _element(where, i, lengths))
        lengths.append(length)
        level = [item for items in lists for item in items]
    numbers = [
        item
        if type(item) is float and math.isfinite(item)
        else number_at(item, path, _element(where, i, lengths))
        for i, item in enumerate(level)
    ]
    return np.array(numbers, dtype=np.float64).reshape(lengths)


def _element(where: str, i: int, lengths: list[int]) -> str:
    """The name of the i-th element of nested lists of these lengths."""
    index = np.unravel_index(i, lengths) if lengths else ()
    return where + "".join(f"[{k}]" for k in index)


def member(of: Mapping[str, object], key: str, path: Path, where: str = "") -> object:
    """What the object has under a key that must be there; `where` names the object."""
    if key not in of:
        found = ", ".join(list(of)[:12]) or "nothing"
        raise InputError(
            "log-key-missing",
            f'{_name(path, where)} has no "{key}"; it has {found[:200]}.',
            where=place(path, where),
            fix=_COPY_FIX,
        )
    return of[key]


def inside(where: str, key: str) -> str:
    """The name of a member: "frame 17, timestamp", or the key alone at the top of the file."""
    return f"{where}, {key}" if where else key


def place(path: Path, where: str) -> str:
    """File and what in it, for messages."""
    return f"{path}, {where}" if where else str(path)


def _name(path: Path, where: str) -> str:
    return f"{where} of {path.name}" if where else path.name


def _damaged(what: str, where: str) -> InputError:
    return InputError("log-damaged", what, where=where, fix=_COPY_FIX)


def _wrong(value: object, expected: str, path: Path, where: str) -> InputError:
    if isinstance(value, list):
        found = f"a list of {len(cast(list[object], value))}"
    else:
        found = _KINDS.get(type(value).__name__, "a number")
    return _damaged(f"{_name(path, where)} is {found} instead of {expected}.", place(path, where))


def _not_finite(number: str, where: str) -> InputError:
    return InputError(
        "log-not-finite",
        f"The log has {number} where a number belongs.",
        where=where,
        fix="Record the take again; the tracker or the app failed there.",
    )


def _no_json(error: json.JSONDecodeError, path: Path) -> InputError:
    # What is left is at most a piece of a number or word: the file ends where it was cut.
    piece = re.fullmatch(r"[\w.+\-\\]*\s*", error.doc[error.pos :])
    cut = error.msg.startswith("Unterminated") or (piece and not error.msg.startswith("Extra"))
    fix = "The app was stopped or the copy was interrupted: copy the session from the phone again."
    return InputError(
        "log-truncated" if cut else "log-damaged",
        f"{path.name} {'is cut short' if cut else 'is no JSON'}: {error.msg}.",
        where=f"{path}:{error.lineno}",
        fix=fix if cut else _COPY_FIX,
    )


CameraKeys = tuple[str, str, str, str, str, str]
"""What a format calls fx, fy, cx, cy, width and height."""


@dataclass(frozen=True)
class Record:
    """One frame, and where it stands."""

    values: JsonObject
    path: Path
    where: str = ""
    """Its name in the file, e.g. "frame 17"; "" when it is the file."""


@dataclass(frozen=True)
class Records:
    """The frames of a log, in order."""

    rows: tuple[Record, ...]

    def place(self, row: int) -> str:
        """File and name of a frame, for messages."""
        return place(self.rows[row].path, self.rows[row].where)

    def column(self, key: str, *shape: int) -> Float64[np.ndarray, "frames ..."]:
        """The numbers that every frame has under a key.

        Raises:
            InputError: a frame without the key, or with anything else than such numbers.
        """
        numbers = [
            numbers_at(
                member(row.values, key, row.path, row.where),
                shape,
                row.path,
                inside(row.where, key),
            )
            for row in self.rows
        ]
        return np.array(numbers, dtype=np.float64).reshape(len(self.rows), *shape)

    def columns(self, keys: Sequence[str]) -> Float64[np.ndarray, "frames keys"]:
        """One number under each of the keys."""
        return np.stack([self.column(key) for key in keys], axis=1)

    def any_has(self, key: str) -> bool:
        """Whether the log knows the key at all."""
        return any(key in row.values for row in self.rows)

    def ordered_by(self, key: str) -> "Records":
        """The same frames, the number under a key never decreasing."""
        order = np.argsort(self.column(key), kind="stable")
        return Records(tuple(self.rows[i] for i in order))


def one_file_each(files: Sequence[Path]) -> Records:
    """Records that are whole files."""
    return Records(tuple(Record(load_object(file), file) for file in files))


def pinhole(
    records: Records, keys: CameraKeys
) -> tuple[Float64[np.ndarray, "frames 4"] | None, tuple[int, int] | None]:
    """fx, fy, cx, cy of every frame and the one image size; nothing where the log has none.

    Raises:
        InputError: a frame without one of them, or with an image of another size.
    """
    if not records.any_has(keys[0]):
        return None, None
    return records.columns(keys[:4]), one_size(records.columns(keys[4:]), records.place)


def named_records(log: Path) -> Records:
    """The frames of a file that is one object of them, in the order of their names.

    Raises:
        InputError: as `load_object`, and for a member that is no object.
    """
    frames = sorted(load_object(log).items())
    return Records(tuple(Record(object_at(value, log, name), log, name) for name, value in frames))


def line_records(log: Path) -> Iterator[Record]:
    """The objects of a file that has one a line (JSON Lines); blank lines are none.

    Raises:
        InputError: "log-too-large"; "log-truncated" for a last line that is no object, and
            "log-damaged" for any other.
    """
    if log.stat().st_size > MAX_BYTES:
        raise InputError(
            "log-too-large",
            f"{log.name} has {log.stat().st_size / 2**20:.0f} MB; a phone log has at most "
            f"{MAX_BYTES / 2**20:.0f}.",
            where=str(log),
            fix="Give the folder that the capture app wrote.",
        )
    with log.open("rb") as file:
        for number, line in enumerate(file, start=1):
            if line.strip():
                yield _line_record(line, log, f"line {number}")


def nested(records: Records, key: str) -> Records:
    """The objects that all records have under a key."""
    return Records(tuple(_part(row, key) for row in records.rows))


def _part(row: Record, key: str) -> Record:
    where = inside(row.where, key)
    value = member(row.values, key, row.path, row.where)
    return Record(object_at(value, row.path, where), row.path, where)


def _line_record(line: bytes, log: Path, where: str) -> Record:
    try:
        value = strict_json.parse(line)
    except strict_json.DoubledKeyError as problem:
        raise InputError(
            "log-damaged",
            f"{where.capitalize()} of {log.name} is damaged: {problem}.",
            where=f"{log}, {where}",
            fix=_COPY_FIX,
        ) from None
    except ValueError:
        cut = not line.endswith(b"\n")
        raise InputError(
            "log-truncated" if cut else "log-damaged",
            f"{where.capitalize()} of {log.name} is {'cut short' if cut else 'no JSON'}.",
            where=f"{log}, {where}",
            fix=f"Copy the session from the phone again{', or delete this line' if cut else ''}.",
        ) from None
    return Record(object_at(value, log, where), log, where)
