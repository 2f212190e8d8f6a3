"""What an archive may hold: the bounds, and the checks that every member passes.

An archive comes from anywhere, so nothing it says is believed: names may point outside the
folder, members may be links, sizes may be lies. All of it is judged from the listing, before
anything is written.
"""

import re
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
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
        """Where the member goes, relative to the folder; None for what is not unpacked.

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
