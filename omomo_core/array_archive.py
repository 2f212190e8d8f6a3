"""Files of named arrays (.npz) that are written, and read, without holding a whole array in memory."""

import zipfile
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from omomo_core.errors import DamageError
from omomo_core.long_arrays import let_go, row_blocks


@dataclass(frozen=True)
class ArrayBlocks:
    """An array that is made block by block while it is written."""

    shape: tuple[int, ...]
    dtype: np.dtype
    blocks: Iterable[np.ndarray]
    """Its numbers in their order; converted to the dtype."""

    def whole(self) -> np.ndarray:
        """Return the array."""
        flat = [np.ascontiguousarray(block, self.dtype).reshape(-1) for block in self.blocks]
        return np.concatenate(flat).reshape(self.shape)


class ArrayArchive:
    """A file of named arrays in the making; equal arrays make equal files, those of `np.savez`."""

    def __init__(self, file: zipfile.ZipFile) -> None:
        """Begin without arrays."""
        self._file = file

    def write(self, arrays: Mapping[str, np.ndarray | ArrayBlocks]) -> None:
        """Add arrays; one that lies in a file leaves nothing in memory."""
        for name, array in arrays.items():
            if isinstance(array, np.ndarray):
                array = ArrayBlocks(array.shape, array.dtype, array_blocks(array))
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


def array_blocks(array: np.ndarray) -> Generator[np.ndarray]:
    """Yield an array block by block; one that lies in a file leaves nothing in memory."""
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


def read_row(path: Path, names: Iterable[str], row: int) -> dict[str, np.ndarray]:
    """Return one row of each array; the other rows are passed over, and never all in memory.

    Raises as zipfile and numpy do on a damaged file, and DamageError.
    """
    rows: dict[str, np.ndarray] = {}
    with zipfile.ZipFile(path) as file:
        for name in names:
            shape, dtype, start = _described(file, f"{name}.npy")
            size = int(np.prod(shape[1:])) * dtype.itemsize
            with file.open(f"{name}.npy") as member:
                member.seek(start + row * size)
                found = np.frombuffer(bytearray(member.read(size)), dtype)
            rows[name] = found.reshape(shape[1:])
    return rows


def names_in(path: Path) -> list[str]:
    """Return the names of the arrays of a file."""
    with zipfile.ZipFile(path) as file:
        return [name.removesuffix(".npy") for name in file.namelist()]


def shapes_of(path: Path) -> dict[str, tuple[int, ...]]:
    """Return the shapes of the arrays of a file, of which every byte is checked.

    Raises as zipfile and numpy do on a damaged file, and DamageError.
    """
    shapes: dict[str, tuple[int, ...]] = {}
    with zipfile.ZipFile(path) as file:
        if (damaged := file.testzip()) is not None:
            raise DamageError(f"{damaged.removesuffix('.npy')} is damaged")
        for name in file.namelist():
            shapes[name.removesuffix(".npy")] = _described(file, name)[0]
    return shapes


def _described(file: zipfile.ZipFile, name: str) -> tuple[tuple[int, ...], np.dtype, int]:
    """Return shape and type of an array of a file, and the byte at which its numbers begin."""
    with file.open(name) as member:
        if np.lib.format.read_magic(member) != (1, 0):
            raise DamageError("it is of a later numpy")
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(member)
        if fortran or dtype.hasobject:
            raise DamageError("its arrays are not as they were written")
        return shape, dtype, member.tell()


def read_arrays(path: Path, wanted: Callable[[str], bool] | None = None) -> dict[str, np.ndarray]:
    """Return the arrays of a file, all or those of some names, as numpy reads them and raises."""
    # Opened here and not by numpy, which leaves a damaged file open.
    with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
        return {name: file[name] for name in file.files if wanted is None or wanted(name)}
