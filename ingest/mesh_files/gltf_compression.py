"""Compressed parts of glTF files unpacked: meshopt's buffers and Draco's primitives.

Both decoders come with the extra "compressed" (meshopt, DracoPy).
"""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int64

from omomo_core.errors import DamageError, InputError

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO = "KHR_draco_mesh_compression"
_MOST_UNPACKED = 500 * 10**6
"""Bytes of one unpacked buffer."""


def _decoder(module: str, extension: str, path: Path) -> Any:
    try:
        return import_module(module)
    except ImportError:
        raise InputError(
            "gltf-compressed",
            f"{path.name} is compressed ({extension}), and {module}, which unpacks it, is not installed.",
            where=str(path),
            fix="Run pip install 'omocap[compressed]', or export the file without compression.",
        ) from None


def unpacked_view(data: bytes, told: Mapping[str, Any], extension: str, path: Path) -> bytes:
    """Return the bytes of a buffer view that meshopt packed.

    Args:
        data: the packed bytes.
        told: the extension's object of the view.
        extension: its name, for messages.
        path: the file, for messages.

    Raises:
        InputError: "gltf-compressed" without the decoder.
        ValueError: the view is damaged.
    """
    decoder = _decoder("meshopt", extension, path)
    count, stride = int(told["count"]), int(told["byteStride"])
    if not 0 <= count * stride <= _MOST_UNPACKED or count < 0 or not 0 < stride <= 256:
        raise DamageError("a compressed view has an impossible size")
    mode, filter_ = str(told["mode"]), str(told.get("filter", "NONE"))
    return np.asarray(decoder.decode_gltf_buffer(data, count, stride, mode, filter_)).tobytes()


class DracoPrimitive:
    """The attributes and triangles of a primitive that Draco packed."""

    def __init__(self, data: bytes, told: Mapping[str, Any], path: Path) -> None:
        """Unpack it.

        Args:
            data: the packed bytes.
            told: the extension's object of the primitive.
            path: the file, for messages.

        Raises:
            InputError: "gltf-compressed" without the decoder.
            Exception: the data is damaged.
        """
        self._mesh = _decoder("DracoPy", DRACO, path).decode(data)
        self._numbers = told["attributes"]

    def has(self, attribute: str) -> bool:
        """Whether this attribute was packed."""
        return attribute in self._numbers

    def values(self, attribute: str, *, normalized: bool) -> np.ndarray:
        """Values of an attribute, (count, components); floats where they are normalised integers."""
        found = self._mesh.get_attribute_by_unique_id(int(self._numbers[attribute]))
        values = np.asarray(found["data"])
        values = values.reshape(len(values), -1)
        if not normalized or values.dtype.kind == "f":
            return values
        return np.maximum(values / np.iinfo(values.dtype).max, -1.0)

    @property
    def triangles(self) -> Int64[np.ndarray, "faces 3"]:
        """Which vertices the triangles have; none of a point cloud."""
        faces = getattr(self._mesh, "faces", None)
        empty = np.empty((0, 3), np.int64)
        return empty if faces is None else np.asarray(faces, np.int64).reshape(-1, 3)
