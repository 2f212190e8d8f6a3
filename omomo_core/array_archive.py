"""Files of named arrays (.npz) that are written, and read, without holding a whole array in memory."""

import zipfile
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from omomo_core.long_arrays import let_go, row_blocks


@dataclass(frozen=True)
class ArrayBlocks:
    """An array that is made block by block while it is written."""

    shape: tuple[int, ...]
    dtype: np.dtype
    blocks: Iterable[np.ndarray]
    """Its numbers in their order; converted to the dtype."""


class ArrayArchive:
    """A file of named arrays in the making; equal arrays make equal files, those of `np.savez`."""

    def __init__(self, file: zipfile.ZipFile) -> None:
        """Begin without arrays."""
        self._file = file

    def write(self, arrays: Mapping[str, np.ndarray | ArrayBlocks]) -> None:
        """Add arrays; one that lies in a file leaves nothing in memory."""
        for name, array in arrays.items():
            if isinstance(array, np.ndarray):
                array = ArrayBlocks(array.shape, array.dtype, _blocks_of(array))
            self._write(f"{name}.npy", array)

    def _write(self, member: str, array: ArrayBlocks) -> None:
        described = {
            "descr": np.lib.format.dtype_to_descr(array.dtype),
            "fortran_order": False,
            "shape": array.shape,
        }
        with self._file.open(member, "w", force_zip64=True) as stream:
            np.lib.format.write_array_header_1_0(stream, described)
            for block in array.blocks:
                stream.write(np.ascontiguousarray(block, array.dtype).tobytes())


def _blocks_of(array: np.ndarray) -> Generator[np.ndarray]:
    if array.ndim == 0:
        yield array
        return
    for block in row_blocks(len(array)):
        yield array[block]
        let_go(array)


@contextmanager
def array_archive(path: Path, *, compressed: bool = False) -> Generator[ArrayArchive]:
    """A file of named arrays that is complete when the block ends; numpy stamps every member 1980-01-01."""
    how = zipfile.ZIP_DEFLATED if compressed else zipfile.ZIP_STORED
    with zipfile.ZipFile(path, "w", how, allowZip64=True) as file:
        yield ArrayArchive(file)


def read_arrays(path: Path, wanted: Callable[[str], bool] | None = None) -> dict[str, np.ndarray]:
    """Return the arrays of a file, all or those of some names, as numpy reads them and raises."""
    # Opened here and not by numpy, which leaves a damaged file open.
    with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
        return {name: file[name] for name in file.files if wanted is None or wanted(name)}
