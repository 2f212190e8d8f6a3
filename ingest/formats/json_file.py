"""JSON logs, read strictly: every defect is an InputError naming file and key or frame."""

import json
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NoReturn, cast

import numpy as np
from jaxtyping import Float64

from omomo_core import strict_json
from omomo_core.errors import InputError

MAX_BYTES = 64 * 2**20
"""Half an hour of 60 poses a second with their intrinsics."""

JsonObject = dict[str, object]

_KINDS = {"dict": "an object", "str": "a text", "bool": "true or false", "NoneType": "null"}
_COPY_FIX = "Copy the session from the phone again; do not edit the log."


def mentions(path: Path, *keys: str) -> bool:
    """Whether a file that begins like a JSON object has all these keys somewhere; never raises.

    A cheap look for `detect`: a damaged log is still recognised, and `load_object` says what is
    wrong with it.
    """
    try:
        if not path.is_file() or path.stat().st_size > MAX_BYTES:
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
    if path.stat().st_size > MAX_BYTES:
        raise InputError(
            "log-too-large",
            f"{path.name} has {path.stat().st_size / 2**20:.0f} MB; this reader takes at most "
            f"{MAX_BYTES / 2**20:.0f}.",
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
