"""A disk that forgets what was not flushed: what would be left after a power cut."""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

import pytest


class Disk:
    """Knows of each file and folder as it was when it was last flushed.

    A file's bytes survive from its flush on, a name from the flush of its folder on. As a disk may
    also keep what was not flushed, this is the least that survives.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._flushed: dict[int, object] = {}
        flush = os.fsync

        def fsync(handle: int) -> None:
            flush(handle)
            self._flushed[os.fstat(handle).st_ino] = self._state(handle)

        monkeypatch.setattr(os, "fsync", fsync)

    def lost(self, root: Path) -> list[str]:
        """What under this folder, or of its own name, would not be there any more."""
        return [str(path) for path in [*_tree(root), root.parent] if not self._survives(path)]

    def _survives(self, path: Path) -> bool:
        handle = os.open(path, os.O_RDONLY)
        try:
            return self._flushed.get(os.fstat(handle).st_ino) == self._state(handle)
        finally:
            os.close(handle)

    def _state(self, handle: int) -> object:
        """Of a folder its names, of a file its bytes as far as their time tells them."""
        known = os.fstat(handle)
        if stat.S_ISDIR(known.st_mode):
            names = [(e.name, e.inode()) for e in os.scandir(handle) if e.is_file() or e.is_dir()]
            return frozenset(name for name in names if not name[0].startswith("."))
        return known.st_size, known.st_mtime_ns


def _tree(root: Path) -> Iterator[Path]:
    yield root
    if root.is_dir():
        yield from root.rglob("*")


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Disk:
    return Disk(monkeypatch)
