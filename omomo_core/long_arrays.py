"""Arrays with a row for each frame of a long take: they grow in a file, and are worked on block by block.

An array in a file is mapped into memory: it reads as any other, the system loads the pages that are looked
at, and `let_go` gives them back. So memory holds the blocks at work, whatever the length of the take.
"""

import mmap
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, TypeVar, overload

import numpy as np

_T = TypeVar("_T")

BLOCK = 1800
"""Frames that are worked on at once: a minute."""


class GrowingArray:
    """Rows that are added one stretch after another."""

    def __init__(self, folder: Path | None = None) -> None:
        """Begin without rows.

        Args:
            folder: where the rows go, in a file without a name that is gone with the array; None for memory.
        """
        self._file = None if folder is None else TemporaryFile(dir=folder)  # noqa: SIM115
        self._parts: list[np.ndarray] = []
        self._rows = 0

    def add(self, rows: np.ndarray) -> None:
        """Add rows after those that are there."""
        self._rows += len(rows)
        if self._file is None:
            self._parts.append(rows)
        else:
            self._file.write(np.ascontiguousarray(rows).data)
            self._parts = [rows[:0].copy()]

    def whole(self) -> np.ndarray:
        """Return all rows; there must be one at least, and none is added afterwards."""
        if self._file is None:
            return np.concatenate(self._parts)
        like = self._parts[0]
        with self._file as file:
            file.flush()
            # What is written to the array does not reach the file; torch takes no array that is read-only.
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY)
        return np.ndarray((self._rows, *like.shape[1:]), like.dtype, buffer=mapped)


class ReadLater(Sequence[_T]):
    """Things of which each is read when it is looked at."""

    def __init__(self, count: int, read: Callable[[int], _T], *, keep: bool) -> None:
        """Read nothing yet.

        Args:
            count: how many there are.
            read: reads one by its index.
            keep: what was read stays in memory; else it is read each time.
        """
        self._count = count
        self._read = cache(read) if keep else read

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> _T: ...
    @overload
    def __getitem__(self, index: slice) -> list[_T]: ...
    def __getitem__(self, index: int | slice) -> _T | list[_T]:
        if isinstance(index, slice):
            return [self[k] for k in range(self._count)[index]]
        return self._read(range(self._count)[index])


def let_go(array: np.ndarray) -> None:
    """Give back the memory of an array that lies in a file; it is read again when it is looked at again."""
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    if isinstance(base, mmap.mmap) and hasattr(base, "madvise"):
        base.madvise(mmap.MADV_DONTNEED)


def row_blocks(rows: int, size: int = BLOCK) -> Iterator[slice]:
    """Yield the blocks into which so many rows are divided."""
    return (slice(start, min(start + size, rows)) for start in range(0, rows, size))


def in_blocks(
    compute: Callable[..., np.ndarray], *arrays: np.ndarray, lost: int = 0, around: int = 16
) -> np.ndarray:
    """Return what `compute` makes of arrays, computed block by block.

    Args:
        compute: takes the arrays, or the same stretch of each, and returns an array with `lost` rows fewer.
            A row depends on those of the arrays around it alone.
        arrays: of equal length.
        lost: rows by which the result is shorter, at its end.
        around: so many rows before and after a row may matter to it.
    """
    rows, parts = len(arrays[0]), list[np.ndarray]()
    for block in row_blocks(rows):
        first, last = max(0, block.start - around), min(rows, block.stop + around)
        made = compute(*(array[first:last] for array in arrays))
        stop = block.stop if block.stop < rows else max(rows - lost, block.start)
        parts.append(made[block.start - first : stop - first])
        for array in arrays:
            let_go(array)
    return np.concatenate(parts)
