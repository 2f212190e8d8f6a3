"""Stills: single pictures in files, decoded when they are asked for."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from ingest.formats.pictures import picture_size
from ingest.scan.types import Colours, Grey
from omomo_core.errors import InputError

MAX_PIXELS = 110_000_000
"""Of one picture; phones make up to 108 million."""
HEIC = (".heic", ".heif")


@dataclass(frozen=True)
class Stills:
    """Pictures in files."""

    files: tuple[Path, ...]
    names: tuple[str, ...]
    turns: int | None = None
    """Quarter turns counter-clockwise that bring the stored pixels upright; None: as the file says."""

    def greys(self, wanted: Sequence[int], width: int) -> Iterator[tuple[int, Grey]]:
        """Some of them, small; see `Pictures`."""
        for index, picture in self.colours(wanted):
            grey = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.uint8)
            yield index, narrowed(grey, width)

    def colours(self, wanted: Sequence[int]) -> Iterator[tuple[int, Colours]]:
        """Some of them as they are; see `Pictures`."""
        for index in wanted:
            picture = load_picture(self.files[index], keep=self.turns is not None)
            if picture is not None:
                yield index, np.ascontiguousarray(np.rot90(picture, self.turns or 0))


def load_picture(file: Path, *, keep: bool) -> Colours | None:
    """The pixels of a file, None where it is damaged or no picture.

    Args:
        file: JPEG, PNG, or HEIC where pillow-heif is installed.
        keep: as the pixels are stored, whatever the file says of its orientation.

    Raises:
        InputError: "picture-heic" or "picture-large".
    """
    if file.suffix.lower() in HEIC:
        return _load_heic(file)
    size = picture_size(file)
    if size is not None and size[0] * size[1] > MAX_PIXELS:
        raise InputError(
            "picture-large",
            f"{file.name} has {size[0]} x {size[1]} pixels.",
            where=str(file),
            fix=f"Make it smaller than {MAX_PIXELS // 10**6} megapixels; 12 are plenty.",
        )
    flags = cv2.IMREAD_COLOR | (cv2.IMREAD_IGNORE_ORIENTATION if keep else 0)
    picture = cv2.imread(str(file), flags)
    return None if picture is None else np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2RGB))


def _load_heic(file: Path) -> Colours | None:
    # Pillow reads HEIC by a plug-in that not everybody may install.
    try:
        from pillow_heif import read_heif  # pyright: ignore[reportMissingImports]
    except ImportError:
        raise InputError(
            "picture-heic",
            f"{file.name} is in HEIC, which is not read here.",
            where=str(file),
            fix="Run pip install pillow-heif; or export the photos as JPEG (on the phone: Settings, "
            "Camera, Formats, Most Compatible).",
        ) from None
    try:
        return np.asarray(read_heif(file).to_pillow().convert("RGB"), np.uint8)
    except (ValueError, OSError):
        return None


def narrowed(picture: np.ndarray, width: int) -> np.ndarray:
    """The picture made smaller if its longer side is longer than `width` pixels."""
    height, wide = picture.shape[:2]
    longest = max(height, wide)
    if longest <= width:
        return np.ascontiguousarray(picture)
    size = max(1, round(wide * width / longest)), max(1, round(height * width / longest))
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
