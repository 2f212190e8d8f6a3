"""The layout of a scene pack: a JSON header, then plain arrays. What is in them is in docs/replay.md."""

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from omomo_core.motion import FPS
from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS

VERSION = 1
_ALIGN = 8
_EMPTY: dict[str, Any] = {
    "start_time": 0.0,
    "object": None,
    "body": None,
    "samples": 0,
    "chosen": 0,
    "first": 0,
    "scores": [],
    "contacts": [],
    "editable": False,
    "stretches": [],
    "floor": None,
    "report": None,
    "events": [],
    "notes": [],
    "faults": [],
    "phone": None,
    "film": None,
    "fps": FPS,
    "joint_names": ALL_JOINTS,
    "joint_parents": ALL_PARENTS,
}


def pack_bytes(header: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> bytes:
    """A scene pack.

    Args:
        header: what the JSON says besides `version` and `arrays`; what it leaves out is empty.
        arrays: by name; of types that a browser's typed arrays know (no 64 bits).
    """
    header_part: dict[str, Any] = {}
    parts: list[bytes] = []
    offset = 0
    for name, array in arrays.items():
        dtype = array.dtype.newbyteorder("<")
        raw = _padded(np.ascontiguousarray(array, dtype).tobytes())
        header_part[name] = {"dtype": dtype.str[1:], "shape": list(array.shape), "offset": offset}
        parts.append(raw)
        offset += len(raw)
    whole = {"version": VERSION, **_EMPTY, **header, "arrays": header_part}
    text = json.dumps(whole, allow_nan=False).encode()
    return b"".join([_padded(struct.pack("<I", len(text)) + text), *parts])


def _padded(raw: bytes) -> bytes:
    return raw + bytes(-len(raw) % _ALIGN)
