"""Single pictures: PNG files and contact sheets."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from omomo_core.errors import InputError
from omomo_core.whole_file import whole_file


def write_png(path: Path, picture: UInt8[np.ndarray, "h w 3"]) -> None:
    """Write an RGB picture.

    Raises:
        InputError: those of `whole_file`.
    """
    _, data = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))
    with whole_file(path) as partial:
        partial.write_bytes(data.tobytes())


def contact_sheet(
    pictures: Sequence[UInt8[np.ndarray, "h w 3"]], columns: int, *, gap: int = 4
) -> UInt8[np.ndarray, "sheet_h sheet_w 3"]:
    """Pictures of one size side by side, row by row, on white; `gap` in pixels.

    Raises:
        InputError: there is no picture.
    """
    if not pictures:
        raise InputError("no-frames", "There is no picture for the sheet.")
    h, w = pictures[0].shape[:2]
    columns = min(columns, len(pictures))
    rows = -(-len(pictures) // columns)
    sheet = np.full((rows * (h + gap) - gap, columns * (w + gap) - gap, 3), 255, np.uint8)
    for k, picture in enumerate(pictures):
        top, left = k // columns * (h + gap), k % columns * (w + gap)
        sheet[top : top + h, left : left + w] = picture
    return sheet
