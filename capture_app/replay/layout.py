"""The bytes of a scene pack: a JSON header, then plain arrays.

    uint32, little-endian: length of the header in bytes
    the header, JSON in UTF-8
    zeros up to a multiple of 8 bytes
    the arrays, little-endian, each from a multiple of 8 bytes on

The header's `arrays` tells of each its `dtype` ("f4", "i2", "i1", "u1", "u2" or "u4"), `shape`, and
`offset` in bytes from the first array. docs/replay.md lists what a pack holds.
"""

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

VERSION = 1
_ALIGN = 8


def pack_bytes(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> bytes:
    """A scene pack.

    Args:
        header: what the JSON says besides `version` and `arrays`.
        arrays: by name; of types that a browser's typed arrays know (no 64 bits).
    """
    told: dict[str, Any] = {}
    parts: list[bytes] = []
    offset = 0
    for name, array in arrays.items():
        dtype = array.dtype.newbyteorder("<")
        raw = _padded(np.ascontiguousarray(array, dtype).tobytes())
        told[name] = {"dtype": dtype.str[1:], "shape": list(array.shape), "offset": offset}
        parts.append(raw)
        offset += len(raw)
    text = json.dumps({"version": VERSION, **header, "arrays": told}, allow_nan=False).encode()
    return b"".join([_padded(struct.pack("<I", len(text)) + text), *parts])


def _padded(raw: bytes) -> bytes:
    return raw + bytes(-len(raw) % _ALIGN)
