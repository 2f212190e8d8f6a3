"""member_paths: the only way from a name that a client gives to a path on the disk."""

import re
from collections.abc import Sequence
from pathlib import PurePosixPath
from unicodedata import category, normalize

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
    seen: dict[str, bool] = {}
    for path in paths:
        _enter(path, seen)
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


def _enter(path: PurePosixPath, seen: dict[str, bool]) -> None:
    """Note a file and the folders around it; no two names may be one on any disk."""
    keys = [normalize("NFC", str(step)).casefold() for step in (*reversed(path.parents), path)][1:]
    clash = any(seen.setdefault(folder, False) for folder in keys[:-1])
    if clash or keys[-1] in seen:
        raise InputError(
            "member-duplicate",
            "A name occurs twice (capital letters do not count).",
            where=f"{str(path)!r:.90}",
            fix=_FIX,
        )
    seen[keys[-1]] = True


def _bytes(name: str) -> int:
    return len(name.encode(errors="surrogatepass"))
