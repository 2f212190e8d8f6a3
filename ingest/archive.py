"""Archives of sessions: listed and bounded before anything is unpacked (zip, tar, gzip).

An archive is listed to its end and judged before anything is unpacked, then
judged again member by member while it is unpacked, and its bytes are counted.

An archive comes from anywhere, so nothing it says is believed: names may point outside the
folder, members may be links, sizes may be lies. All of it is judged from the listing, before
anything is written.

POSIX ustar and pax, and GNU long names. `tarfile` parses the header blocks. Its `TarFile` is not
used because it keeps every member, reads extended headers of any length at once, and takes a damaged
header for the end; its `data_filter` lets links and absolute names through and bounds nothing.
"""

import atexit
import gzip
import re
import shutil
import stat
import struct
import tarfile
import tempfile
import threading
import zipfile
import zlib
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from io import BufferedIOBase
from pathlib import Path
from typing import IO, Literal
from unicodedata import category, normalize

from omomo_core.errors import InputError

MAX_ENTRIES = 200_000
"""Files and folders. Ten minutes at 60 Hz with a picture, a depth map and its confidence for each
pose are 108,000 files."""
MAX_BYTES = 16 * 2**30
"""Unpacked. Those ten minutes are several GB."""
MAX_RATIO = 200
"""Unpacked over packed. Pose logs shrink to a third, pictures not at all."""
RATIO_FLOOR = 64 * 2**20
"""Bytes that may come out of however small an archive."""
MAX_DEPTH = 16
MAX_NAME = 1024

_SKIPPED = ("__MACOSX", ".DS_Store")
_NO_TEXT = ("Cc", "Cs")
_DRIVE = re.compile(r"[A-Za-z]:")
COPY_FIX = "Copy the archive again, or unpack it yourself and give the folder."
_PACK_FIX = "Pack the session folder itself again, as .zip or .tar.gz, or give the folder."
_ONE_FIX = "Give the archive of one session, or unpack it yourself and give the folder."


Kind = Literal["file", "folder", "other"]


@dataclass(frozen=True)
class Member:
    """One entry of an archive, as the archive describes it."""

    name: str
    size: int
    """Bytes, unpacked."""
    kind: Kind
    """Links, devices and what else is neither file nor folder are "other"."""
    total: int
    """Bytes to unpack up to and with this member."""
    content: Callable[[], Iterator[bytes]]
    """Its bytes, piece by piece; to be read before the next member is asked for."""


CHUNK = 2**20
"""Bytes held in memory at a time."""


def refusal(code: str, what: str, archive: Path, fix: str = COPY_FIX) -> InputError:
    """The error of an archive that is not unpacked."""
    return InputError(f"archive-{code}", what, where=str(archive), fix=fix)


def refuse_count(entries: int, archive: Path) -> None:
    """Refuse more entries than any session has."""
    if entries > MAX_ENTRIES:
        what = f"The archive holds more than {MAX_ENTRIES:,} files."
        raise refusal("too-many-entries", what, archive, _ONE_FIX)


def kind_of_mode(mode: int) -> Kind:
    """What a Unix mode says a member is; 0 (no mode given) is a file."""
    kinds: dict[int, Kind] = {0: "file", stat.S_IFREG: "file", stat.S_IFDIR: "folder"}
    return kinds.get(stat.S_IFMT(mode), "other")


class Inventory:
    """Takes the members of an archive one by one and refuses it at the first that is not safe."""

    def __init__(self, archive: Path) -> None:
        self.total = 0
        """Bytes to unpack, of the members seen so far."""
        self._archive = archive
        self._most_by_ratio = max(RATIO_FLOOR, MAX_RATIO * archive.stat().st_size)
        self._seen = 0
        self._is_file: dict[str, bool] = {}

    def admit(self, member: Member) -> Path | None:
        """Return the member's path relative to the folder; None for what is not unpacked.

        Raises:
            InputError: "archive-too-many-entries", "archive-path", "archive-link",
                "archive-too-large", "archive-ratio", "archive-duplicate".
        """
        self._seen += 1
        parts = self._parts(member.name)
        if member.kind == "other":
            what = f"{member.name!r:.90} is a link, a device or another special file."
            raise refusal("link", what, self._archive, _PACK_FIX)
        self._bound_size(member.total)
        wanted = bool(parts) and not any(p in _SKIPPED or p.startswith("._") for p in parts)
        if wanted:
            self._enter(parts, member.kind == "file")
        refuse_count(max(self._seen, len(self._is_file)), self._archive)
        return Path(*parts) if wanted else None

    def _parts(self, name: str) -> list[str]:
        parts = [part for part in name.split("/") if part not in ("", ".")]
        faults = {
            "is an absolute path": name.startswith("/") or _DRIVE.match(name),
            "points out of the archive": ".." in parts,
            "holds a backslash": "\\" in name,
            "holds control characters or is no UTF-8": any(category(c) in _NO_TEXT for c in name),
            "is too long": max(map(_bytes, [*parts, ""])) > 255 or _bytes(name) > MAX_NAME,
            f"is more than {MAX_DEPTH} folders deep": len(parts) > MAX_DEPTH,
        }
        for fault, found in faults.items():
            if found:
                what = f"The name {name!r:.90} {fault}."
                raise refusal("path", what, self._archive, _PACK_FIX)
        return parts

    def _bound_size(self, total: int) -> None:
        self.total = total
        if total > MAX_BYTES:
            what = f"The archive would unpack to more than {MAX_BYTES / 2**30:g} GB."
            raise refusal("too-large", what, self._archive, _ONE_FIX)
        if total > self._most_by_ratio:
            what = f"It would unpack to more than {MAX_RATIO} times its size; no session does."
            raise refusal("ratio", what, self._archive, _PACK_FIX)

    def _enter(self, parts: list[str], is_file: bool) -> None:
        """Note the file or folder and the folders around it; no two may meet on any disk."""
        keys = [_key("/".join(parts[: n + 1])) for n in range(len(parts))]
        folders = keys[:-1] if is_file else keys
        clash = any(self._is_file.setdefault(folder, False) for folder in folders)
        if clash or (is_file and keys[-1] in self._is_file):
            what = f"The name {'/'.join(parts)!r:.90} occurs twice (capital letters do not count)."
            raise refusal("duplicate", what, self._archive, _PACK_FIX)
        if is_file:
            self._is_file[keys[-1]] = True


def _key(name: str) -> str:
    """The same for names that a disk may take for one (case, composed accents)."""
    return normalize("NFC", name).casefold()


def _bytes(name: str) -> int:
    return len(name.encode(errors="surrogatepass"))


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
            content = partial(_tar_content, tape, start, size)
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
        raise ValueError("a header is damaged") from error
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


def _tar_content(tape: BufferedIOBase, start: int, size: int) -> Iterator[bytes]:
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


_DIRECTORY_BYTES = 320 * MAX_ENTRIES
"""Directory bytes of the whole table: 46 bytes, a name and some extras for each entry."""
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
            content = partial(_zip_content, archive, info)
            # The name as it is written: ZipInfo.filename ends at a NUL.
            yield Member(info.orig_filename, info.file_size, kind, total, content)


def _zip_content(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> Iterator[bytes]:
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
    """Return the offset of the table of contents, its size in bytes, and how many entries it claims."""
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
    """Return the offset of the end record, which stands at the very end or before a comment."""
    last = len(tail) - _END.size
    if tail.startswith(b"PK\x05\x06", max(last, 0)) and tail.endswith(b"\0\0"):
        return last
    at = tail.rfind(b"PK\x05\x06")
    return at if at <= last else -1


_SPARE_BYTES = 2**30
"""Left free on the disk for everything else."""

_DISK_FIX = "Free some space, or name a folder on another disk in the variable TMPDIR."
_DAMAGE = (
    zipfile.BadZipFile,
    gzip.BadGzipFile,
    zlib.error,
    EOFError,
    ValueError,
    OverflowError,
    NotImplementedError,
)

_lock = threading.Lock()
_unpacked: dict[tuple[Path, int, int], Path] = {}


def is_archive(path: Path) -> bool:
    """Whether it is a file that is one, by its first bytes.

    Raises:
        OSError: the file cannot be read.
    """
    if path.is_dir():
        return False
    head = _head(path)
    return is_zip(head) or is_tar(head)


def unpack(path: Path) -> Path:
    """The folder with what the archive holds; it lives as long as the process.

    The same file is unpacked once. A refused archive leaves nothing behind.

    Raises:
        InputError: "archive-..." for an archive that is damaged, too large or not safe, and where
            the disk has no room.
    """
    state = path.stat()
    key = (path.resolve(), state.st_size, state.st_mtime_ns)
    with _lock:
        if key not in _unpacked:
            _unpacked[key] = _unpack(path)
        return _unpacked[key]


def _unpack(path: Path) -> Path:
    listed = Inventory(path)
    with _damage_is_named(path):
        for member in _members(path):
            listed.admit(member)
    _refuse_full_disk(path, listed.total)
    with ExitStack() as undo:
        folder = Path(tempfile.mkdtemp(prefix="omocap-session-"))
        undo.callback(shutil.rmtree, folder, ignore_errors=True)
        # The file may have changed since it was listed: it is judged again.
        inventory = Inventory(path)
        with _damage_is_named(path):
            for member in _members(path):
                place = inventory.admit(member)
                if place is not None:
                    _write(member, folder / place, path)
        atexit.register(undo.pop_all().close)
    return folder


def _write(member: Member, target: Path, archive: Path) -> None:
    if member.kind == "folder":
        target.mkdir(parents=True, exist_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    written = 0
    with target.open("xb") as file:
        for chunk in member.content():
            written += len(chunk)
            if written > member.size:
                break
            file.write(chunk)
    if written != member.size:
        what = f"{member.name!r:.90} has not the {member.size} bytes that the archive says."
        raise refusal("size", what, archive)


def _members(path: Path) -> Iterator[Member]:
    return zip_members(path) if is_zip(_head(path)) else tar_members(path)


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(BLOCK)


def _refuse_full_disk(path: Path, needed: int) -> None:
    folder = tempfile.gettempdir()
    free = shutil.disk_usage(folder).free
    if needed + _SPARE_BYTES > free:
        raise refusal(
            "disk",
            f"Unpacking needs {needed / 2**30:.1f} GB; {folder} has {free / 2**30:.1f} GB free.",
            path,
            _DISK_FIX,
        )


@contextmanager
def _damage_is_named(path: Path) -> Generator[None]:
    """Turn what the readers raise on damaged files, and errors of the disk, into InputErrors."""
    try:
        yield
    except _DAMAGE as error:
        why = (
            str(error) if type(error) is ValueError else "its bytes are not as its format has them"
        )
        raise refusal("damaged", f"The archive is damaged: {why}.", path) from error
    except OSError as error:
        what = f"The archive cannot be unpacked: {error.strerror}."
        raise refusal("disk", what, path, _DISK_FIX) from error
