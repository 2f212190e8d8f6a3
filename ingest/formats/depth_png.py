"""Depth maps as phones store them: grey PNG files of 16 bits, in millimetres."""

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32

from omomo_core.errors import InputError

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_MAX_SIDE = 4096


def load_millimetres(file: Path) -> Float32[np.ndarray, "height width"]:
    """Read a depth map in metres; 0 stays 0 (unknown).

    Raises:
        InputError: "depth-damaged" for anything else than such a PNG of a phone's size.
    """
    data = file.read_bytes()
    sides = [int.from_bytes(data[at : at + 4], "big") for at in (16, 20)]
    # Measured before it is decoded: a small file may hold an image that fills the memory.
    if data.startswith(_SIGNATURE) and 0 < min(sides) <= max(sides) <= _MAX_SIDE:
        depth = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
        if depth is not None and depth.ndim == 2 and depth.dtype == np.uint16:
            return depth.astype(np.float32) / np.float32(1000)
    raise InputError(
        "depth-damaged",
        f"{file.name} is no grey PNG with 16 bits a pixel, at most {_MAX_SIDE} a side.",
        where=str(file),
        fix="Copy the session from the phone again.",
    )


def save_millimetres(metres: Float32[np.ndarray, "height width"], file: Path) -> None:
    """Write what `load_millimetres` reads, up to 65.535 m."""
    millimetres = np.rint(metres * 1000).clip(0, 65535).astype(np.uint16)
    file.write_bytes(cv2.imencode(".png", millimetres)[1].tobytes())
