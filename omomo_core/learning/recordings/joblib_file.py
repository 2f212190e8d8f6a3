"""Files of joblib (and plain pickles) of dicts, lists, text, numbers and arrays, read without running them.

A pickle is a program that may call anything. Here the few names that an array needs lead to inert
stand-ins, made afresh for each file; any other name ends the reading. No function of numpy is called
but `frombuffer`, with a plain number type. What joblib adds: the raw bytes of an array stand in the
stream after its description, and the whole may be compressed.
"""

import bz2
import gzip
import io
import lzma
import pickle
import zipfile
import zlib
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from omomo_core.errors import InputError

_LARGEST = 16 * 2**30
"""Bytes of an uncompressed file: the release has less than a tenth of that."""
_DEEPEST = 4
_DAMAGED = (
    pickle.UnpicklingError, EOFError, OSError, ValueError, TypeError, KeyError, IndexError,
    AttributeError, ImportError, MemoryError, OverflowError, RecursionError, NotImplementedError,
    zlib.error, lzma.LZMAError, zipfile.BadZipFile,
)  # fmt: skip


def read_joblib(path: Path) -> Any:
    """What a joblib or pickle file holds; arrays of numbers as numpy arrays, those of objects as lists.

    Raises:
        InputError: ``pickle-refused`` when the file wants more than data; ``pickle-damaged``.
    """
    with _as_data(path) as at, path.open("rb") as file:
        return _plain(_Reader(_Stream(_decompressed(file), at)).load())


def read_pickled_array(path: Path, name: str) -> list[Any]:
    """The objects of an array in an npz that numpy reads only with ``allow_pickle=True``.

    Args:
        path: the npz.
        name: of the array.

    Raises:
        InputError: as `read_joblib`.
    """
    with (
        _as_data(path) as at,
        zipfile.ZipFile(path) as archive,
        archive.open(f"{name}.npy") as member,
    ):
        stream = cast(io.BufferedIOBase, member)
        _skip_header(stream)
        found = _plain(_Reader(_Stream(stream, at)).load())
    return found if isinstance(found, list) else [found]


def _skip_header(file: io.BufferedIOBase) -> None:
    """Leave the file where the pickle of an array of objects begins."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0
    if version != (1, 0):
        read = np.lib.format.read_array_header_2_0
    if not read(file)[2].hasobject:
        raise ValueError("the array holds no objects")


@contextmanager
def _as_data(path: Path) -> Generator["_Place"]:
    """Turn what is wrong with a file that is being read into an error that names the place."""
    at = _Place()
    try:
        yield at
    except _DAMAGED as problem:
        raise InputError(
            "pickle-damaged",
            f"The file is damaged or no joblib file: {problem}.",
            where=f"{path}, byte {at.byte}",
            fix="Download it again.",
        ) from problem
    except _RefusedError as problem:
        raise InputError(
            "pickle-refused",
            f"The file asks for {problem}, which data does not need; it was not run.",
            where=f"{path}, byte {at.byte}",
            fix="Use the original file.",
        ) from None


@dataclass
class _Place:
    """How far a file has been read, unpacked."""

    byte: int = 0


class _RefusedError(Exception):
    """A pickle names something that is not part of an array."""


class _Stream:
    """Reads what is asked for and never ahead, so that raw array bytes can be taken in between."""

    def __init__(self, file: io.BufferedIOBase, at: _Place) -> None:
        self._file, self._at = file, at

    def read(self, count: int) -> bytes:
        if not 0 <= count <= _LARGEST - self._at.byte:
            raise ValueError("it is larger than any motion data")
        data = self._file.read(count)
        self._at.byte += len(data)
        if len(data) != count:
            raise EOFError("it ends in the middle")
        return data

    def readline(self) -> bytes:
        line = self._file.readline(65536)
        self._at.byte += len(line)
        return line


def _decompressed(file: io.BufferedIOBase) -> io.BufferedIOBase:
    """The file, unpacked by its first bytes as joblib packs: zlib, gzip, bz2, xz or lzma."""
    start = file.read(6)
    file.seek(0)
    if start[:2] == b"\x1f\x8b":
        return gzip.GzipFile(fileobj=cast(Any, file))
    if start[:1] == b"\x78":
        return io.BufferedReader(_Zlib(file))
    if start[:2] == b"BZ":
        return bz2.BZ2File(cast(Any, file))
    if start == b"\xfd7zXZ\x00" or start[:2] == b"\x5d\x00":
        return lzma.LZMAFile(cast(Any, file))
    return file


class _Zlib(io.RawIOBase):
    """A zlib stream as a file."""

    def __init__(self, file: io.BufferedIOBase) -> None:
        self._file, self._unpack = file, zlib.decompressobj()

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        view = memoryview(buffer)
        while not self._unpack.eof:
            packed = self._unpack.unconsumed_tail or self._file.read(65536)
            if not packed:
                return 0
            if data := self._unpack.decompress(packed, len(view)):
                view[: len(data)] = data
                return len(data)
        return 0


class _Array:
    """An array being put together; `value` is it."""

    stream: _Stream
    value: np.ndarray | list[Any] | None = None

    def __setstate__(self, state: Any) -> None:
        if isinstance(state, dict):
            self.value = _from_joblib(cast(dict[str, Any], state), self.stream)
        else:
            _, shape, dtype, fortran, data = state
            if isinstance(data, list):  # an array of objects
                self.value = cast(list[Any], data)
            else:
                self.value = _array(data, dtype, shape, fortran=bool(fortran))


class _Type:
    """A numpy type by name, with the byte order that follows in its state."""

    def __init__(self, name: str, *_: Any) -> None:
        self.name, self.order = str(name), "="

    def __setstate__(self, state: Any) -> None:
        self.order = str(state[1])

    def dtype(self) -> np.dtype[Any]:
        found = np.dtype(self.name)
        if found.kind not in "biufUS":
            raise ValueError(f"arrays of type {found} are not numbers or text")
        return found.newbyteorder(self.order) if self.order in "<>" else found  # type: ignore[arg-type]


class _Reader(pickle.Unpickler):
    def __init__(self, stream: _Stream) -> None:
        super().__init__(cast(Any, stream))
        # A pickle can set attributes of what it is given: these live as long as this file.
        array = type("Array", (_Array,), {"stream": stream})
        kind = type("Type", (_Type,), {})
        made: dict[tuple[str, str], Callable[..., Any]] = {
            ("joblib.numpy_pickle", "NumpyArrayWrapper"): array,
            ("numpy", "ndarray"): type("Kind", (), {}),
            ("numpy", "dtype"): kind,
        }
        for module in ("numpy.core", "numpy._core"):
            made[f"{module}.multiarray", "_reconstruct"] = lambda *_: array()
            made[f"{module}.multiarray", "scalar"] = lambda dtype, data: _scalar(data, dtype)
        made["_codecs", "encode"] = lambda text, _="latin1": text.encode("latin1")
        self._made = made

    def find_class(self, module_name: str, global_name: str, /) -> Any:
        try:
            return self._made[module_name, global_name]
        except KeyError:
            raise _RefusedError(f"{module_name}.{global_name}") from None


def _from_joblib(state: dict[str, Any], stream: _Stream) -> np.ndarray:
    dtype, shape = state["dtype"], state["shape"]
    count = int(np.prod([int(n) for n in shape], dtype=object))
    if state.get("numpy_array_alignment_bytes") is not None:
        stream.read(stream.read(1)[0])
    data = stream.read(count * dtype.dtype().itemsize)
    return _array(data, dtype, shape, fortran=state["order"] == "F")


def _array(data: object, dtype: _Type, shape: tuple[int, ...], *, fortran: bool) -> np.ndarray:
    if not isinstance(data, bytes):
        raise ValueError("an array is not made of numbers or text")
    flat = np.frombuffer(data, dtype.dtype())
    found = flat.reshape(shape[::-1]).T if fortran else flat.reshape(shape)
    if found.dtype.kind != "f":
        return found
    # Half the memory, and more than the accuracy of any motion capture. What is too large becomes
    # infinite, which whoever reads the array refuses.
    with np.errstate(over="ignore"):
        return found.astype(np.float32)


def _scalar(data: bytes, dtype: _Type) -> Any:
    return _array(data, dtype, (), fortran=False).item()


def _plain(value: Any, depth: int = 0) -> Any:
    """The containers with every stand-in replaced by its array."""
    if depth > _DEEPEST:
        raise ValueError("it is nested deeper than motion data")
    if isinstance(value, _Array):
        return value.value if not isinstance(value.value, list) else _plain(value.value, depth)
    if isinstance(value, dict):
        return {k: _plain(v, depth + 1) for k, v in cast(dict[Any, Any], value).items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v, depth + 1) for v in cast(list[Any], value)]
    return value
