"""Uploads that are not whole yet, and the safe paths of the files in them."""

import os
import re
import time
from collections.abc import Sequence
from datetime import datetime
from functools import lru_cache
from pathlib import Path, PurePosixPath
from unicodedata import category, normalize

from pydantic import BaseModel, Field, ValidationError

from capture_app.commands.inputs import DescribedModel, ItemKind
from capture_app.library_item import FILES, Name, now, save_info
from capture_app.web.problems import Refused
from capture_app.web.shelves import keep_tree, missing, new_id, remove_folder
from omomo_core.errors import InputError

MAX_DEPTH = 16
MAX_PATH = 1024
MAX_PART = 200
"""Bytes; less than the 255 that disks take, for what we write beside a file."""

_DRIVE = re.compile(r"^[A-Za-z]:")
_DEVICE = re.compile(r"^(con|prn|aux|nul|com[0-9¹²³]|lpt[0-9¹²³]|conin\$|conout\$)(\.|$)", re.I)
"""Names that Windows gives to devices, whatever their ending."""
_FORBIDDEN = frozenset('<>:"|?*\\')
_NO_TEXT = ("Cc", "Cs", "Cn", "Co")
_FIX = "Rename it, or pack the folder as a .zip and upload that."


def member_paths(names: Sequence[str]) -> list[PurePosixPath]:
    """Paths inside a folder, safe on every disk, that do not meet on any.

    Args:
        names: as the client says them, with "/" between folders.

    Raises:
        InputError: "member-path" or "member-duplicate".
    """
    paths = [_checked(name) for name in names]
    entered: dict[str, bool] = {}
    for path in paths:
        _enter(path, entered)
    return paths


def _checked(name: str) -> PurePosixPath:
    parts = name.split("/")
    faults = {
        "is empty": not name,
        "is an absolute path": name.startswith("/") or _DRIVE.match(name),
        "holds a step that leads nowhere": any(part in ("", ".", "..") for part in parts),
        "holds characters that a disk does not take": any(c in _FORBIDDEN for c in name),
        "holds control characters": any(category(c) in _NO_TEXT for c in name),
        "ends in a dot or a blank": any(part != part.strip(" ").rstrip(".") for part in parts),
        "is the name of a device": any(_DEVICE.match(part) for part in parts),
        "is too long": _bytes(name) > MAX_PATH or max(map(_bytes, parts)) > MAX_PART,
        f"is more than {MAX_DEPTH} folders deep": len(parts) > MAX_DEPTH,
    }
    for fault, found in faults.items():
        if found:
            raise InputError("member-path", f"A name {fault}.", where=f"{name!r:.90}", fix=_FIX)
    return PurePosixPath(name)


def _enter(path: PurePosixPath, entered: dict[str, bool]) -> None:
    """Note a file and the folders around it; no two names may be one on any disk."""
    keys = [normalize("NFC", str(step)).casefold() for step in (*reversed(path.parents), path)][1:]
    clash = any(entered.setdefault(folder, False) for folder in keys[:-1])
    if clash or keys[-1] in entered:
        raise InputError(
            "member-duplicate",
            "A name occurs twice (capital letters do not count).",
            where=f"{str(path)!r:.90}",
            fix=_FIX,
        )
    entered[keys[-1]] = True


def _bytes(name: str) -> int:
    return len(name.encode(errors="surrogatepass"))


"""Material is all else that a calibration, an overlay or a scan reads: photos, a log, a model."""
UPLOAD = "upload.json"
_REMEMBERED = 16
_LISTED = 3
"""Files that an error names."""


class Announced(DescribedModel):
    """A file that shall come."""

    path: str = Field(max_length=2048)
    """Its name, with "/" between folders."""
    size: int = Field(ge=0, lt=2**53)
    """Bytes."""


class Upload(BaseModel):
    """upload.json."""

    kind: ItemKind
    name: Name
    created: datetime = Field(default_factory=now)
    files: list[Announced]

    @property
    def size(self) -> int:
        """Bytes of all files together."""
        return sum(file.size for file in self.files)


class Uploads:
    """The folder of all partial uploads."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        # Read for every piece that comes, and as long as the list of its files.
        self._read = lru_cache(_REMEMBERED)(self._load)

    def begin(self, kind: ItemKind, name: str, files: Sequence[Announced]) -> str:
        """Make room for files whose sizes are within the limits.

        Returns:
            The id of the upload, which will be the id of the thing too.

        Raises:
            InputError: as `member_paths`.
        """
        member_paths([file.path for file in files])
        id_ = new_id()
        (self.folder / id_ / FILES).mkdir(parents=True)
        save_info(self.folder / id_ / UPLOAD, Upload(kind=kind, name=name, files=list(files)))
        return id_

    def get(self, id_: str) -> Upload:
        """Return what was announced of an upload.

        Raises:
            Refused: 404 when there is no such upload.
        """
        place = self.folder / id_ / UPLOAD
        if not place.is_file():
            raise missing("upload", id_)
        return self._read(place)

    def _load(self, place: Path) -> Upload:
        try:
            return Upload.model_validate_json(place.read_bytes())
        except (OSError, ValidationError):
            raise missing("upload", place.parent.name) from None

    def list(self) -> "list[tuple[str, Upload]]":
        """All by id, the newest first."""
        uploads: list[tuple[str, Upload]] = []
        for place in self.folder.glob("[0-9a-f]*"):
            try:
                uploads.append((place.name, self.get(place.name)))
            except Refused:
                continue
        return sorted(uploads, key=lambda item: (item[1].created, item[0]), reverse=True)

    def place(self, id_: str, upload: Upload, index: int) -> Path:
        """Return the path to which the bytes of one of its files go.

        Raises:
            Refused: 404 when there is no such file.
        """
        if not 0 <= index < len(upload.files):
            raise missing("upload-file", f"{id_}/{index}")
        # Checked when it was announced; checked again because the file could have been edited.
        (path,) = member_paths([upload.files[index].path])
        return self._place(id_, path)

    def received(self, id_: str, upload: Upload) -> "list[int]":
        """Bytes that have arrived of each file."""
        root = os.fspath(self.folder / id_ / FILES)
        return [_length(f"{root}/{file.path}") for file in upload.files]

    def touch(self, id_: str) -> None:
        """Note that somebody goes on with it."""
        os.utime(self.folder / id_ / UPLOAD)

    def complete(self, id_: str, upload: Upload) -> Path:
        """The folder to be put on a shelf, once everything is there and on the disk.

        Raises:
            Refused: 409 with the first files that are not.
        """
        have = self.received(id_, upload)
        pairs = zip(upload.files, have, strict=True)
        short = [file.path for file, size in pairs if size != file.size]
        if short:
            raise Refused(
                409,
                "upload-incomplete",
                f"{len(short)} of {len(have)} files are not there as a whole yet.",
                where=", ".join(short[:_LISTED]),
                fix="Send what is missing and finish again.",
            )
        for file in upload.files:
            if file.size == 0:
                place = self._place(id_, PurePosixPath(file.path))
                place.parent.mkdir(parents=True, exist_ok=True)
                place.touch()
        keep_tree(self.folder / id_)
        return self.folder / id_

    def remove(self, id_: str) -> None:
        """Take it away.

        Raises:
            Refused: 404 when there is no such upload.
        """
        self.get(id_)
        remove_folder(self.folder / id_)

    def sweep(self, older: float) -> "list[str]":
        """Take away what nobody went on with for so many seconds; returns their ids."""
        limit = time.time() - older
        remnants = [
            id_ for id_, _ in self.list() if (self.folder / id_ / UPLOAD).stat().st_mtime < limit
        ]
        for id_ in remnants:
            remove_folder(self.folder / id_)
        return remnants

    def _place(self, id_: str, path: PurePosixPath) -> Path:
        return self.folder / id_ / FILES / path


def _length(path: str) -> int:
    try:
        return os.stat(path).st_size
    except FileNotFoundError:
        return 0
