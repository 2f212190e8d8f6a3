"""The members of a tar file (plain or gzip), read as a stream in bounded memory.

POSIX ustar and pax, and GNU long names. `tarfile` parses the header blocks. Its `TarFile` is not
used because it keeps every member, reads extended headers of any length at once, and takes a damaged
header for the end; its `data_filter` lets links and absolute names through and bounds nothing.
"""

import gzip
import tarfile
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
_NOTES = (tarfile.XHDTYPE, tarfile.XGLTYPE, tarfile.GNUTYPE_LONGNAME)
_KINDS: dict[bytes, Kind] = dict.fromkeys(
    (tarfile.REGTYPE, tarfile.AREGTYPE, tarfile.CONTTYPE), "file"
)
_KINDS[tarfile.DIRTYPE] = "folder"

Records = dict[bytes, bytes]


def is_tar(head: bytes) -> bool:
    """Whether a file that begins like this is a tar file or compressed with gzip."""
    return head.startswith(_GZIP) or head[257:262] == b"ustar" or _begins_with_header(head)


def _begins_with_header(head: bytes) -> bool:
    try:
        _parse(head[:BLOCK])
    except ValueError:
        return False
    return True


def tar_members(path: Path) -> Iterator[Member]:
    """The members in the order of the file.

    Raises:
        ValueError, EOFError, zlib.error, gzip.BadGzipFile: damaged.
    """
    shared: Records = {}
    with _open(path) as tape:
        while (header := _next_header(tape, shared)) is not None:
            info, records = header
            name = _name(info, records)
            size = _size(info, records)
            start = tape.tell()
            end = start + _padded(size)
            content = partial(_content, tape, start, size)
            yield Member(name, size, _kind(info, records, name), end, content)
            tape.seek(end)
        _check_end(tape)


def _open(path: Path) -> BufferedIOBase:
    with path.open("rb") as file:
        packed = file.read(len(_GZIP)) == _GZIP
    return gzip.open(path) if packed else path.open("rb")


def _next_header(tape: BufferedIOBase, shared: Records) -> tuple[tarfile.TarInfo, Records] | None:
    """The header of the next member and what extended headers say of it; None at the end."""
    own: Records = {}
    for _ in range(_MAX_NOTES):
        block = _exactly(tape, BLOCK)
        if block == bytes(BLOCK):
            return None
        info = _parse(block)
        if info.type not in _NOTES:
            return info, shared | own
        if info.size > _MAX_NOTE:
            raise ValueError("an extended header is too long")
        note = _exactly(tape, _padded(info.size))[: info.size]
        if info.type == tarfile.GNUTYPE_LONGNAME:
            own[b"path"] = note.rstrip(b"\0")
        else:
            (shared if info.type == tarfile.XGLTYPE else own).update(_records(note))
    raise ValueError("there are too many extended headers")


def _parse(block: bytes) -> tarfile.TarInfo:
    try:
        info = tarfile.TarInfo.frombuf(block, "utf-8", "surrogateescape")
    except tarfile.HeaderError as error:
        raise ValueError(f"a header is damaged ({error})") from error
    if info.size < 0:
        raise ValueError("a size is negative")
    return info


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


def _kind(info: tarfile.TarInfo, records: Records, name: str) -> Kind:
    if _SPARSE in records:
        return "other"
    kind = _KINDS.get(info.type, "other")
    # Tar files of before 1988 tell folders by their names alone.
    return "folder" if kind == "file" and name.endswith("/") else kind


def _size(info: tarfile.TarInfo, records: Records) -> int:
    """Bytes of content that follow; folders have none, whatever their header says."""
    if info.isdir():
        return 0
    given = records.get(b"size")
    if given is None:
        return info.size
    if not given.isdigit() or len(given) > 20:
        raise ValueError("a size is no number")
    return int(given)


def _name(info: tarfile.TarInfo, records: Records) -> str:
    name = records.get(b"path")
    return info.name if name is None else name.decode("utf-8", errors="surrogateescape")


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


def _padded(size: int) -> int:
    return -(-size // BLOCK) * BLOCK
