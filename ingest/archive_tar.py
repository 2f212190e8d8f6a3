"""The members of a tar file (plain or gzip), read as a stream in bounded memory.

POSIX ustar and pax, and GNU long names. Written out because the standard library keeps every
member, reads headers of any length at once, and takes a damaged header for the end.
"""

import gzip
from collections.abc import Iterator
from functools import partial
from io import BufferedIOBase
from pathlib import Path

from ingest.archive_members import CHUNK, Kind, Member

BLOCK = 512
_GZIP = b"\x1f\x8b"
_MAX_NOTE = 2**20
"""Bytes of an extended header; macOS puts extended attributes there."""
_MAX_NOTES = 8
_MAX_RECORDS = 64
_SPARSE = b"GNU.sparse"
_MAX_PADDING = 2**20
_NOTES = (b"x", b"g", b"L")
_KINDS: dict[bytes, Kind] = dict.fromkeys((b"0", b"\0", b"7"), "file")
_KINDS[b"5"] = "folder"

Records = dict[bytes, bytes]


def is_tar(head: bytes) -> bool:
    """Whether a file that begins like this is a tar file or compressed with gzip."""
    return head.startswith(_GZIP) or head[257:262] == b"ustar" or _sum_is_right(head[:BLOCK])


def tar_members(path: Path) -> Iterator[Member]:
    """The members in the order of the file.

    Raises:
        ValueError, EOFError, zlib.error, gzip.BadGzipFile: damaged.
    """
    shared: Records = {}
    with _open(path) as tape:
        while (header := _next_header(tape, shared)) is not None:
            block, records = header
            name = _name(block, records)
            size = _size(block, records)
            start = tape.tell()
            end = start + _padded(size)
            content = partial(_content, tape, start, size)
            yield Member(name, size, _kind(block, records, name), end, content)
            tape.seek(end)
        _check_end(tape)


def _open(path: Path) -> BufferedIOBase:
    with path.open("rb") as file:
        packed = file.read(len(_GZIP)) == _GZIP
    return gzip.open(path) if packed else path.open("rb")


def _next_header(tape: BufferedIOBase, shared: Records) -> tuple[bytes, Records] | None:
    """The header block of the next member and what extended headers say of it; None at the end."""
    own: Records = {}
    for _ in range(_MAX_NOTES):
        block = _exactly(tape, BLOCK)
        if block == bytes(BLOCK):
            return None
        if not _sum_is_right(block):
            raise ValueError("a header does not have its checksum")
        if block[156:157] not in _NOTES:
            return block, shared | own
        size = _number(block[124:136])
        if size > _MAX_NOTE:
            raise ValueError("an extended header is too long")
        note = _exactly(tape, _padded(size))[:size]
        if block[156:157] == b"L":
            own[b"path"] = note.rstrip(b"\0")
        else:
            (shared if block[156:157] == b"g" else own).update(_records(note))
    raise ValueError("there are too many extended headers")


def _records(note: bytes) -> Records:
    """The pax records that matter here, each "length key=value" and a line end."""
    records: Records = {}
    at = 0
    for _ in range(_MAX_RECORDS):
        if at >= len(note):
            return records
        digits, _, _ = note[at : at + 8].partition(b" ")
        end = at + int(digits)
        key, equals, value = note[at + len(digits) + 1 : end - 1].partition(b"=")
        if not equals or not digits.isdigit() or note[end - 1 : end] != b"\n":
            raise ValueError("an extended header is damaged")
        if key[: len(_SPARSE)] in (b"path", b"size", _SPARSE):
            records[key[: len(_SPARSE)]] = value
        at = end
    raise ValueError("an extended header has too many records")


def _kind(block: bytes, records: Records, name: str) -> Kind:
    if _SPARSE in records:
        return "other"
    kind = _KINDS.get(block[156:157], "other")
    # Tar files of before 1988 tell folders by their names alone.
    return "folder" if kind == "file" and name.endswith("/") else kind


def _size(block: bytes, records: Records) -> int:
    """Bytes of content that follow; folders have none, whatever their header says."""
    if block[156:157] == b"5":
        return 0
    given = records.get(b"size")
    if given is None:
        return _number(block[124:136])
    if not given.isdigit() or len(given) > 20:
        raise ValueError("a size is no number")
    return int(given)


def _name(block: bytes, records: Records) -> str:
    name = records.get(b"path")
    if name is None:
        name = _field(block[:100])
        prefix = _field(block[345:500]) if block[257:263] == b"ustar\0" else b""
        name = prefix + b"/" + name if prefix else name
    return name.decode("utf-8", errors="surrogateescape")


def _content(tape: BufferedIOBase, start: int, size: int) -> Iterator[bytes]:
    tape.seek(start)
    for at in range(0, size, CHUNK):
        yield _exactly(tape, min(CHUNK, size - at))


def _check_end(tape: BufferedIOBase) -> None:
    """Read on to the end of a gzip file, where its checksum is; tar files end in zeros."""
    if len(tape.read(_MAX_PADDING)) == _MAX_PADDING:
        raise ValueError("something follows its end")


def _exactly(tape: BufferedIOBase, size: int) -> bytes:
    data = tape.read(size)
    if len(data) < size:
        raise EOFError("it is cut short")
    return data


def _sum_is_right(block: bytes) -> bool:
    """The checksum is that of the header with blanks in its place."""
    try:
        given = _number(block[148:156])
    except ValueError:
        return False
    return len(block) == BLOCK and given == sum(block) - sum(block[148:156]) + 8 * 0x20


def _number(field: bytes) -> int:
    """Octal digits, or binary where the first bit is set."""
    if field[:1] >= b"\x80":
        number = int.from_bytes(field[1:], "big") if field[0] == 0x80 else -1
    else:
        number = int(_field(field).strip() or b"0", 8)
    if number < 0:
        raise ValueError("a number is negative")
    return number


def _field(field: bytes) -> bytes:
    return field.partition(b"\0")[0]


def _padded(size: int) -> int:
    return -(-size // BLOCK) * BLOCK
