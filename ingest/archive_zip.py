"""The members of a zip file, with its table of contents bounded before it is parsed."""

import struct
import zipfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import IO

from ingest.archive_members import CHUNK, MAX_ENTRIES, Member, kind_of_mode, refusal, refuse_count

_DIRECTORY_BYTES = 320 * MAX_ENTRIES
"""Of the whole table: 46 bytes, a name and some extras for each entry."""
_END = struct.Struct("<4s4H2LH")
_END64 = struct.Struct("<4sQ2H2L4Q")
_LOCATOR = struct.Struct("<4sLQL")
_ENTRY = struct.Struct("<4s24x3H12x")
_ENCRYPTED = 0x2041
"""Flag bits: encrypted, strongly encrypted, encrypted table of contents."""


def is_zip(head: bytes) -> bool:
    """Whether a file that begins like this is a zip file (.zip, .r3d)."""
    return head.startswith((b"PK\x03\x04", b"PK\x05\x06"))


def zip_members(path: Path) -> Iterator[Member]:
    """The members in the order of the table of contents.

    Raises:
        InputError: "archive-too-many-entries", "archive-damaged", "archive-encrypted",
            "archive-compression".
        zipfile.BadZipFile, ValueError, NotImplementedError, EOFError, zlib.error: damaged.
    """
    with path.open("rb") as file:
        _bound_directory(file, path)
    total, packed = 0, path.stat().st_size
    with zipfile.ZipFile(path) as archive:
        for info in archive.infolist():
            _refuse_unreadable(info, path)
            if not 0 <= info.header_offset < packed:
                raise ValueError(f"{info.filename!r:.90} lies outside of it")
            total += info.file_size
            kind = "folder" if info.is_dir() else kind_of_mode(info.external_attr >> 16)
            content = partial(_content, archive, info)
            # The name as it is written: ZipInfo.filename ends at a NUL.
            yield Member(info.orig_filename, info.file_size, kind, total, content)


def _content(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> Iterator[bytes]:
    with archive.open(info) as file:
        while chunk := file.read(CHUNK):
            yield chunk


def _refuse_unreadable(info: zipfile.ZipInfo, path: Path) -> None:
    if info.flag_bits & _ENCRYPTED:
        what = f"{info.filename!r:.90} is encrypted."
        raise refusal("encrypted", what, path, "Pack the session again without a password.")
    # The others may need gigabytes of memory for a few bytes of input.
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        what = f"{info.filename!r:.90} is packed in a way other than deflate."
        raise refusal("compression", what, path, "Pack the session again as an ordinary .zip.")


def _bound_directory(file: IO[bytes], path: Path) -> None:
    """Count the entries by hand: ZipFile reads the whole table, however long, into objects."""
    start, size, count = _find_directory(file, path)
    refuse_count(count, path)
    if size > _DIRECTORY_BYTES:
        what = f"Its table of contents has {size / 2**20:.0f} MB; no session needs that."
        raise refusal("too-many-entries", what, path)
    file.seek(start)
    end, entries = start + size, 0
    while file.tell() < end:
        entry = file.read(_ENTRY.size)
        if len(entry) < _ENTRY.size or not entry.startswith(b"PK\x01\x02"):
            raise refusal("damaged", "Its table of contents is damaged.", path)
        file.seek(sum(_ENTRY.unpack(entry)[1:]), 1)
        entries += 1
        refuse_count(entries, path)


def _find_directory(file: IO[bytes], path: Path) -> tuple[int, int, int]:
    """Where the table of contents starts, its size in bytes, and how many entries it claims."""
    length = file.seek(0, 2)
    file.seek(max(0, length - _END.size - 0xFFFF - _LOCATOR.size - _END64.size))
    tail_start, tail = file.tell(), file.read()
    at = _end_record(tail)
    if at < 0:
        raise refusal("damaged", "The archive is cut short: it has no table of contents.", path)
    count, size = _END.unpack_from(tail, at)[4:6]
    at64 = at - _LOCATOR.size - _END64.size
    if at64 >= 0 and tail.startswith(b"PK\x06\x07", at - _LOCATOR.size):
        signature, *_, count, size, _ = _END64.unpack_from(tail, at64)
        at = at64
        if signature != b"PK\x06\x06":
            raise refusal("damaged", "Its table of contents is damaged.", path)
    start = tail_start + at - size
    if start < 0:
        raise refusal("damaged", "Its table of contents is damaged.", path)
    return start, size, count


def _end_record(tail: bytes) -> int:
    """Where the end record stands: at the very end, or before a comment."""
    last = len(tail) - _END.size
    if tail.startswith(b"PK\x05\x06", max(last, 0)) and tail.endswith(b"\0\0"):
        return last
    at = tail.rfind(b"PK\x05\x06")
    return at if at <= last else -1
