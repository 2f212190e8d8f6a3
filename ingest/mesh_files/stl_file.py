"""read_stl: the triangles of an STL file, binary or text."""

import re
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.mesh_files.file_parts import FilePart, ReadMesh, cut_short, too_large
from omomo_core.errors import DamageError

_HEAD, _FACET = 84, 50
"""Bytes of the header with the count, and of each triangle."""
_ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_CORNER = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def read_stl(path: Path, most: int) -> ReadMesh:
    """Read all solids of a file. A binary one may begin with "solid", too: its size tells.

    Args:
        path: the file.
        most: triangles that are read.

    Raises:
        InputError: "mesh-too-large", "mesh-truncated".
        ValueError: the file is damaged.
    """
    data = path.read_bytes()
    corners = _text(data, path) if _is_text(data) else _binary(data, path, most)
    if len(corners) > most:
        raise too_large(path, f"{len(corners):,} triangles")
    faces = np.arange(3 * len(corners), dtype=np.int64).reshape(-1, 3)
    return ReadMesh((FilePart(path.stem, corners.reshape(-1, 3), faces),))


def _is_text(data: bytes) -> bool:
    """Whether it is text: begins so, has no binary bytes, and not the size that a count gives."""
    if data.lstrip()[:5].lower() != b"solid" or _count(data) * _FACET + _HEAD == len(data):
        return False
    return b"\0" not in data[:4096]


def _count(data: bytes) -> int:
    return int.from_bytes(data[80:84], "little") if len(data) >= _HEAD else -1


def _binary(data: bytes, path: Path, most: int) -> Float64[np.ndarray, "faces 3 3"]:
    count = _count(data)
    if count < 0:
        raise DamageError("it is no STL")
    there = (len(data) - _HEAD) // _FACET
    if count > there:
        if there == 0 or count > 2**24:
            raise DamageError("it is no STL")
        raise cut_short(path, f"{there:,} triangles follow its header instead of {count:,}")
    if count > most:
        raise too_large(path, f"{count:,} triangles")
    rows = np.frombuffer(data, _ROW, count, _HEAD)
    return rows["corners"].astype(np.float64)


def _text(data: bytes, path: Path) -> Float64[np.ndarray, "faces 3 3"]:
    words = [word for corner in _CORNER.findall(data) for word in corner]
    comma = next((word for word in words if b"," in word), None)
    if comma is not None:
        raise DamageError(f"{comma.decode(errors='replace')!r} is no number of a vertex")
    numbers = [float(word) for word in words]
    corners, rest = divmod(len(numbers), 9)
    if rest or not re.search(rb"\bendsolid\b", data[-4096:], re.IGNORECASE):
        raise cut_short(path, "it ends within a solid")
    return np.array(numbers, np.float64).reshape(corners, 3, 3)
