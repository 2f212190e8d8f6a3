"""Logs in text: files of a folder, and rows of numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import overload

import numpy as np
from jaxtyping import Float64

from omomo_core.errors import InputError

MAX_BYTES = 256 * 2**20
"""A log of an hour is about 70 MB."""

_CUT_FIX = (
    "The app was stopped or the copy was interrupted while it wrote this line: copy the session "
    "from the phone again, or delete line {line} if the recording before it is enough."
)


@dataclass(frozen=True)
class SplitRows(Sequence[tuple[str, ...]]):
    """Lines that are split into fields when they are looked at: a million fields at once need much memory."""

    lines: Sequence[str]
    separator: str | None
    """None means any white space."""

    def __len__(self) -> int:
        return len(self.lines)

    @overload
    def __getitem__(self, index: int) -> tuple[str, ...]: ...

    @overload
    def __getitem__(self, index: slice) -> "SplitRows": ...

    def __getitem__(self, index: int | slice) -> "tuple[str, ...] | SplitRows":
        if isinstance(index, slice):
            return SplitRows(self.lines[index], self.separator)
        return split_row(self.lines[index], self.separator)


@dataclass(frozen=True)
class TextRows:
    """The fields of each line that is neither blank nor a # comment."""

    path: Path
    rows: Sequence[tuple[str, ...]]
    lines: tuple[int, ...]
    """Line number of each row, from 1."""
    ends_with_newline: bool

    def without_header(self) -> "TextRows":
        """The same rows but the first."""
        return TextRows(self.path, self.rows[1:], self.lines[1:], self.ends_with_newline)


@dataclass(frozen=True)
class NumberTable:
    """Finite numbers of a text file, and the line of each row."""

    path: Path
    values: Float64[np.ndarray, "rows columns"]
    lines: tuple[int, ...]

    def place(self, row: int) -> str:
        """File and line of a row, for messages."""
        return f"{self.path}:{self.lines[row]}"


def read_rows(path: Path, separator: str | None) -> TextRows:
    """Split a text file into fields; `separator` None means any white space."""
    if path.stat().st_size > MAX_BYTES:
        raise InputError(
            "log-too-large",
            f"{path.name} has {path.stat().st_size / 2**20:.0f} MB; a phone log has at most "
            f"{MAX_BYTES / 2**20:.0f}.",
            where=str(path),
            fix="Give the folder that the capture app wrote.",
        )
    text = _decoded(path.read_bytes())
    rows: list[str] = []
    lines: list[int] = []
    for number, line in enumerate(text.split("\n"), start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            rows.append(line.strip("\r\n"))
            lines.append(number)
    return TextRows(path, SplitRows(rows, separator), tuple(lines), text.endswith("\n"))


def _decoded(data: bytes) -> str:
    """The text of UTF-8, or of UTF-16 that says so, as a redirection in PowerShell writes it."""
    coding = "utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8"
    return data.decode(coding, errors="replace").removeprefix("\ufeff")


def split_row(line: str, separator: str | None) -> tuple[str, ...]:
    """The fields of a line, without the quotes and brackets that some apps put around them."""
    return tuple(field.strip().strip('"<>').strip() for field in line.split(separator))


def numbers(text: TextRows, width: int, columns: Sequence[int]) -> NumberTable:
    """The named columns as numbers; every row must have `width` fields.

    Raises:
        InputError: "log-truncated" when the last line is cut, "log-damaged" for any other line
            with missing, extra or unreadable fields, "log-not-finite" for NaN or infinity.
    """
    values = np.empty((len(text.rows), len(columns)))
    for i in range(len(text.rows)):
        values[i] = _row_numbers(text, i, width, columns)
    table = NumberTable(text.path, values, text.lines)
    if not text.ends_with_newline and text.rows:
        _refuse_cut_number(text, columns)
    finite = np.isfinite(values).all(axis=1)
    if not finite.all():
        raise InputError(
            "log-not-finite",
            f"{text.path.name} has NaN or infinity where a number belongs.",
            where=table.place(int(np.argmin(finite))),
            fix="Record the take again; the tracker or the app failed at this line.",
        )
    return table


def _row_numbers(text: TextRows, i: int, width: int, columns: Sequence[int]) -> list[float]:
    fields = text.rows[i]
    if len(fields) != width:
        raise _damaged(text, i, f"{len(fields)} fields instead of {width}")
    try:
        return [float(fields[c]) for c in columns]
    except ValueError:
        bad = next(fields[c] for c in columns if not _is_number(fields[c]))
        if _is_number(bad.replace(",", ".")):
            raise InputError(
                "log-decimal-comma",
                f"Numbers of {text.path.name} have a decimal comma, such as {bad[:30]!r}.",
                where=f"{text.path}:{text.lines[i]}",
                fix="Export the table with decimal points.",
            ) from None
        raise _damaged(text, i, f"{bad[:30]!r} where a number belongs") from None


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _damaged(text: TextRows, i: int, what: str) -> InputError:
    line, last = text.lines[i], i == len(text.rows) - 1
    fix = (
        _CUT_FIX
        if last
        else "Compare the line with the app's own file, or delete it: a missing pose is bridged."
    )
    return InputError(
        "log-truncated" if last else "log-damaged",
        f"Line {line} of {text.path.name} is {'cut short' if last else 'damaged'}: it has {what}.",
        where=f"{text.path}:{line}",
        fix=fix.format(line=line),
    )


def _refuse_cut_number(text: TextRows, columns: Sequence[int]) -> None:
    """A file cut inside its very last number still parses; the missing decimals give it away.

    A number cut after its sixth decimal is within a micrometre of the whole one: harmless.
    """
    width = len(text.rows[-1])
    if max(columns) != width - 1 or len(text.rows) < 2:
        return
    usual = min(_decimals(row[-1]) for row in text.rows[:-1])
    if _decimals(text.rows[-1][-1]) < min(usual, 6):
        number = text.rows[-1][-1]
        raise _damaged(text, len(text.rows) - 1, f"no line end and {number!r} as its last number")


def _decimals(number: str) -> int:
    mantissa, _, exponent = number.lower().partition("e")
    return len(mantissa.partition(".")[2]) - int(exponent or 0)


_HEAD_BYTES = 65536
_MAX_TAKES = 64
"""A folder with more files of a kind holds a file for each frame, not takes."""


def head_lines(path: Path) -> list[str]:
    """The lines within the first 64 KB; [] where there is no file to read."""
    if not path.is_file():  # a pipe would be waited for
        return []
    try:
        with path.open("rb") as file:
            text = _decoded(file.read(_HEAD_BYTES))
    except OSError:
        return []
    return text.split("\n")


def first_row(path: Path) -> str:
    """The first line of a text log that is neither blank nor a # comment; "" where there is none."""
    rows = (line.strip() for line in head_lines(path))
    return next((row for row in rows if row and not row.startswith("#")), "")


def floats(fields: Sequence[str]) -> list[float]:
    """The fields as numbers; [] as soon as one is none."""
    try:
        return [float(field) for field in fields]
    except ValueError:
        return []


def logs(path: Path, names: Sequence[str], is_log: Callable[[Path], bool]) -> list[Path]:
    """The file itself, or the files of the folder matching a name pattern, where `is_log` holds."""
    files = {file for name in names for file in path.glob(name)} if path.is_dir() else {path}
    if len(files) > _MAX_TAKES:
        return []
    return sorted(file for file in files if file.is_file() and is_log(file))


def only_log(path: Path, found: Sequence[Path]) -> Path:
    """The file itself, or the one log found in the folder.

    Raises:
        InputError: "session-ambiguous" for a folder with none or several.
    """
    if not path.is_dir():
        return path
    if len(found) == 1:
        return found[0]
    names = ", ".join(file.name for file in found[:8])
    raise InputError(
        "session-ambiguous",
        f"The folder holds {len(found)} trajectories{': ' if names else ''}{names}.",
        where=str(path),
        fix="Pass one of these files instead of the folder.",
    )
