"""photos_source: a folder of photos, with the focal lengths that they state themselves."""

from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from ingest.scan.sources.stills import HEIC, Stills
from ingest.scan.types import ScanSource

SUFFIXES = (".jpg", ".jpeg", ".png", *HEIC)
_EXIF, _FOCAL_35MM = 0x8769, 0xA405
"""Numbers of the EXIF block and of FocalLengthIn35mmFilm in it (EXIF 2.3)."""
_FILM_DIAGONAL = np.hypot(36.0, 24.0)
"""Millimetres; phones state the focal length with the same angle across the diagonal."""


def photos_in(folder: Path) -> list[Path]:
    """The photos of a folder in the order of their names, hidden files left out."""
    files = folder.iterdir() if folder.is_dir() else ()
    return sorted(
        file
        for file in files
        if file.suffix.lower() in SUFFIXES and not file.name.startswith(".") and file.is_file()
    )


def photos_source(folder: Path) -> ScanSource:
    """The photos in a folder, turned upright as they say."""
    files = tuple(photos_in(folder))
    guess = np.array([focal_of(file) for file in files])
    names = tuple(file.stem for file in files)
    return ScanSource("photos", folder, Stills(files, names), focal_guess=guess)


def focal_of(file: Path) -> float:
    """The focal length that a photo states, in lengths of its longer side; NaN where it does not."""
    try:
        with Image.open(file) as photo:
            stated = photo.getexif().get_ifd(_EXIF).get(_FOCAL_35MM)
            width, height = photo.size
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError):
        return float("nan")
    if not isinstance(stated, int | float) or not 5 < stated < 500:
        return float("nan")
    return float(stated / _FILM_DIAGONAL * np.hypot(width, height) / max(width, height))
