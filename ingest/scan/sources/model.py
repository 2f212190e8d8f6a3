"""model_source: a finished COLMAP model, with the pictures that it was made of."""

from pathlib import Path

import numpy as np

from ingest.colmap_files import read_model
from ingest.formats.pictures import file_inside
from ingest.scan.sources.stills import Stills
from ingest.scan.types import ScanSource
from omomo_core.errors import InputError

_FILES = (".bin", ".txt")
_INSIDE = ("", "sparse", "colmap/sparse")
_IMAGES = ("images", "../images", "../../images", "../../../images", "..", "../..")
"""Where the pictures of a model are as a rule, seen from it."""
MIN_POINTS = 100


def model_in(folder: Path) -> Path | None:
    """The folder of the largest model in a folder, None where there is none."""
    places = [folder / inside for inside in _INSIDE]
    numbered = [sub for place in places if place.is_dir() for sub in sorted(place.glob("[0-9]*"))]
    found = [place for place in [*places, *numbered] if _is_model(place)]
    return max(found, key=_size, default=None)


def _is_model(folder: Path) -> bool:
    return any((folder / f"images{kind}").is_file() for kind in _FILES) and any(
        (folder / f"cameras{kind}").is_file() for kind in _FILES
    )


def _size(folder: Path) -> int:
    files = (folder / f"images{kind}" for kind in _FILES)
    return max(file.stat().st_size for file in files if file.is_file())


def model_source(model: Path, images: Path | None = None) -> ScanSource:
    """The pictures of a COLMAP model.

    Args:
        model: folder with cameras, images and points3D, as .bin or .txt; of any version of COLMAP.
        images: folder of its pictures; looked for beside the model where it is not given.

    Raises:
        InputError: "model-unreadable"; "model-points" when it has next to no points;
            "model-images" when its pictures are not found.
    """
    reconstruction = read_model(model)
    names = sorted(image.name for image in reconstruction.images.values() if image.has_pose)
    if len(reconstruction.points3D) < MIN_POINTS:
        raise InputError(
            "model-points",
            f"The model has {len(reconstruction.points3D)} points: nothing says where its surfaces "
            "are.",
            where=str(model),
            fix="Give a model that was triangulated (points3D is not empty), or give the pictures "
            "themselves to be reconstructed here.",
        )
    folder = images or _images_of(model, names)
    files = {name: file for name in names if (file := file_inside(folder, name)) is not None}
    missing = [name for name in names if name not in files]
    if len(missing) > len(names) // 2:
        raise InputError(
            "model-images",
            f"{len(missing)} of the model's {len(names)} pictures are not there, such as "
            f"{missing[0]}.",
            where=str(folder),
            fix="Give the folder of the pictures that the model was made of (--images).",
        )
    # COLMAP reads the pixels as they are stored.
    stills = Stills(tuple(files.values()), tuple(files), 0)
    return ScanSource("colmap", model, stills, model=model)


def _images_of(model: Path, names: list[str]) -> Path:
    """The usual place that holds most of the pictures."""
    places = [(model / place).resolve() for place in _IMAGES]
    counts = [sum(file_inside(place, name) is not None for name in names) for place in places]
    return places[int(np.argmax(counts))]
