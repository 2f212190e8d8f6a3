"""Depth maps as float32 metres, row by row, in the landscape and size of ARKit's depth."""

from pathlib import Path

import numpy as np
from jaxtyping import Float32

from omomo_core.errors import InputError

SIZE = (256, 192)
"""Width and height."""


def load_metres(file: Path) -> Float32[np.ndarray, "192 256"]:
    """Metres; what is not finite becomes 0 (unknown).

    Raises:
        InputError: "depth-damaged" for a file of another length.
    """
    width, height = SIZE
    size = file.stat().st_size
    if size != 4 * width * height:
        raise InputError(
            "depth-damaged",
            f"{file.name} has {size} bytes; a depth map of {width} x {height} has "
            f"{4 * width * height}.",
            where=str(file),
            fix="Copy the session from the phone again.",
        )
    metres = np.fromfile(file, dtype="<f4").reshape(height, width)
    return np.where(np.isfinite(metres), metres, np.float32(0))


def save_metres(metres: Float32[np.ndarray, "height width"], file: Path) -> None:
    """Write what `load_metres` reads."""
    file.write_bytes(metres.astype("<f4").tobytes())
