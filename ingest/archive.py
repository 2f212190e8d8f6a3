"""Sessions that come as one file: zip (also .r3d), tar and tar.gz, told by their content.

An archive is listed to its end and judged before anything is unpacked (`archive_members`), then
judged again member by member while it is unpacked, and its bytes are counted.
"""

import atexit
import gzip
import shutil
import tempfile
import threading
import zipfile
import zlib
from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from ingest.archive_members import Inventory, Member, refusal
from ingest.archive_tar import BLOCK, is_tar, tar_members
from ingest.archive_zip import is_zip, zip_members

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
    """Whether the file is one, by its first bytes.

    Raises:
        OSError: the file cannot be read.
    """
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
        raise refusal("damaged", f"The archive is damaged: {error}.", path) from error
    except OSError as error:
        what = f"The archive cannot be unpacked: {error.strerror}."
        raise refusal("disk", what, path, _DISK_FIX) from error
