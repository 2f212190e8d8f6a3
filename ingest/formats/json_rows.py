"""Records of JSON logs of many frames: members of one object, or one object a line."""

from collections.abc import Iterator
from pathlib import Path

from ingest.formats.json_file import inside, load_object, member, object_at
from ingest.formats.records import Record, Records
from ingest.formats.table import MAX_BYTES
from omomo_core import strict_json
from omomo_core.errors import InputError


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
            fix="Copy the session from the phone again; do not edit the log.",
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
