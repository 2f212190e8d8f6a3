"""How sure the phone was of each pixel of its depth: files that apps write beside the maps.

Stray Scanner: depth/000000.png and confidence/000000.png, 0 to 2. Polycam: the same folders, 0, 127
or 255. 3D Scanner App: depth_00000.png and conf_00000.png, 0 to 2.
"""

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

_SMALL = 2
"""The highest confidence where it is counted 0, 1, 2."""


def confidence_of(depth: Path) -> UInt8[np.ndarray, "height width"] | None:
    """The confidence of a depth map, 0 (least) to 2, None where there is none."""
    beside = depth.with_name(depth.name.replace("depth_", "conf_", 1))
    folder = depth.parent.parent / "confidence" / depth.name
    file = next((f for f in (beside, folder) if f != depth and f.is_file()), None)
    found = None if file is None else cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
    if found is None or found.ndim != 2:
        return None
    levels = found if found.max(initial=0) <= _SMALL else np.rint(found / 127.5)
    return np.asarray(levels, np.uint8)


def sure(
    metres: Float32[np.ndarray, "height width"],
    confidence: UInt8[np.ndarray, "height width"] | None,
) -> Float32[np.ndarray, "height width"]:
    """The depth with 0 where its confidence is the lowest."""
    if confidence is None or confidence.shape != metres.shape:
        return metres
    return np.where(confidence > 0, metres, np.float32(0))
