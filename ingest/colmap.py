"""COLMAP by pycolmap: its loading, and models in files."""

import ctypes
import signal
import struct
import sys
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from omomo_core.errors import InputError

_ROOM = 256
"""Bytes, more than any system's struct sigaction has."""


@contextmanager
def _sigterm_kept() -> Generator[None]:
    """Keep the process's handler of SIGTERM, whatever the block installs."""
    if sys.platform == "win32":
        yield
        return
    # Python's own signal module could not do it in any thread but the first.
    libc, kept = ctypes.CDLL(None), ctypes.create_string_buffer(_ROOM)
    libc.sigaction(int(signal.SIGTERM), None, kept)
    yield
    libc.sigaction(int(signal.SIGTERM), kept, None)


with _sigterm_kept():
    import pycolmap

__all__ = ["pycolmap"]


_NAMES = ("cameras", "images", "points3D")
_COUNT = struct.Struct("<Q")
_POINT = 43
"""Bytes of a point before the length of its track: id, place, colour, error."""
_IMAGE = 64
"""Bytes of an image before its name: id, rotation, translation, camera."""


class _OddModelError(ValueError):
    """What is wrong with a model, in our words."""


def read_model(folder: Path) -> pycolmap.Reconstruction:
    """Read cameras, images and points3D, as .bin or .txt.

    Raises:
        InputError: "model-unreadable".
    """
    try:
        if all((folder / f"{name}.bin").is_file() for name in _NAMES):
            # pycolmap would take what it reads behind a file's end for a length.
            _walk_images((folder / "images.bin").read_bytes())
            _walk_points((folder / "points3D.bin").read_bytes())
            return pycolmap.Reconstruction(folder)
        if not all((folder / f"{name}.txt").is_file() for name in _NAMES):
            raise _OddModelError("cameras, images and points3D are not all there")
        model = pycolmap.Reconstruction(folder)
        _name_whole(model, folder / "images.txt")
        return model
    except Exception as problem:  # pycolmap raises anything on a damaged file
        why = str(problem) if isinstance(problem, _OddModelError) else "its files are damaged"
        raise InputError(
            "model-unreadable",
            f"This is no COLMAP model: {why}.",
            where=str(folder),
            fix="Give the folder with cameras.bin, images.bin and points3D.bin (or .txt), which is "
            "called sparse/0 as a rule; copy it again if it is that folder.",
        ) from problem


_BEFORE_NAME = 9
"""Fields of an image's line before its name: id, rotation, translation, camera."""


def _name_whole(model: pycolmap.Reconstruction, file: Path) -> None:
    """Give pictures of a text model the whole of their names, which pycolmap 4.2.1 cuts at a blank."""
    lines = iter(file.read_bytes().decode("utf-8", "replace").split("\n"))
    for line in lines:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        fields = line.split(maxsplit=_BEFORE_NAME)
        next(lines, None)  # the line of its points, which may be empty
        if len(fields) <= _BEFORE_NAME or not fields[0].isdigit():
            raise _OddModelError("images.txt has a line that is no image's")
        if int(fields[0]) in model.images:
            model.images[int(fields[0])].name = fields[_BEFORE_NAME].rstrip()


def _walk_images(data: bytes) -> None:
    at = _COUNT.size
    for _ in range(_count(data, 0)):
        name_end = data.index(b"\0", at + _IMAGE)
        at = name_end + 1 + _COUNT.size + 24 * _count(data, name_end + 1)
    _check_end(data, at, "images.bin")


def _walk_points(data: bytes) -> None:
    at = _COUNT.size
    for _ in range(_count(data, 0)):
        at += _POINT + _COUNT.size + 8 * _count(data, at + _POINT)
    _check_end(data, at, "points3D.bin")


def _count(data: bytes, at: int) -> int:
    return int(_COUNT.unpack_from(data, at)[0])


def _check_end(data: bytes, at: int, name: str) -> None:
    if at != len(data):
        raise _OddModelError(f"{name} has {len(data)} bytes where its records end at {at}")
