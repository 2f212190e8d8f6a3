"""Landmarks of a scan: points with descriptors, matched with a picture's features."""

import shutil
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt8
from scipy.spatial import KDTree

from ingest.colmap import pycolmap, read_model
from omomo_core.errors import InputError

_RATIO = 0.85
"""Angle to the best match in units of that to the second best."""
_MAX_ANGLE = 0.8
"""rad; what looks more different is no match."""


@dataclass(frozen=True)
class SiftFeatures:
    """SIFT keypoints and descriptors of a picture."""

    pixels: Float64[np.ndarray, "points 2"]
    """Counted as COLMAP does: (0.5, 0.5) is the centre of the first pixel."""
    descriptors: Float32[np.ndarray, "points 128"]
    """Unit vectors."""


@cache
def _extractor() -> pycolmap.FeatureExtractor:
    pycolmap.logging.minloglevel = pycolmap.logging.Level.ERROR.value
    return pycolmap.FeatureExtractor.create(device=pycolmap.Device.cpu)


def find_features(picture: UInt8[np.ndarray, "height width"]) -> SiftFeatures:
    """The features of a grey picture."""
    bitmap = pycolmap.Bitmap.from_array(np.ascontiguousarray(picture))
    keypoints, descriptors = _extractor().extract(bitmap)
    pixels = np.array([(point.x, point.y) for point in keypoints], np.float64).reshape(-1, 2)
    return SiftFeatures(pixels, unit(descriptors.data))


def unit(descriptors: np.ndarray) -> Float32[np.ndarray, "points 128"]:
    """COLMAP's descriptors as unit vectors."""
    numbers = np.asarray(descriptors, np.float32).reshape(-1, 128)
    return numbers / np.maximum(np.linalg.norm(numbers, axis=1, keepdims=True), 1e-6)


def match(
    ours: Float32[np.ndarray, "ours 128"], theirs: Float32[np.ndarray, "theirs 128"]
) -> tuple[Int64[np.ndarray, " matches"], Int64[np.ndarray, " matches"], Float32[np.ndarray, " m"]]:
    """Features that are each other's best match, by far: index in both, and the angle (rad)."""
    if min(len(ours), len(theirs)) < 2:
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0, np.float32)
    likeness = ours @ theirs.T
    best = likeness.argmax(axis=1)
    mutual = likeness.argmax(axis=0)[best] == np.arange(len(ours))
    first, second = np.arccos(-np.partition(-likeness, 1, axis=1)[:, :2].clip(-1, 1).T)
    kept = np.flatnonzero(mutual & (first < _RATIO * second) & (first < _MAX_ANGLE))
    return kept, best[kept], first[kept]


MAX_IMAGES = 40
"""Pictures of a model whose features are looked at: those that together show its points."""
_AT = 1.0
"""Pixels between a feature found again and the place where the model has it."""
_SAME = 0.01
"""Pixels by which a feature's place in the model may differ from that in the database."""
_MIN_POINTS = 100


@dataclass(frozen=True)
class Sighting:
    """The points of the model that one of its pictures shows."""

    name: str
    points: Int64[np.ndarray, " seen"]
    """Their places in `Landmarks.points`."""
    descriptors: Float32[np.ndarray, "seen 128"]


@dataclass(frozen=True)
class Landmarks:
    """The points of a scan, and their descriptors in each picture."""

    points: Float64[np.ndarray, "points 3"]
    """In the object's frame, metres."""
    sightings: tuple[Sighting, ...]


def read_landmarks(
    model: Path,
    images: Path | None = None,
    database: Path | None = None,
    T_object_model: Float64[np.ndarray, "4 4"] | None = None,
) -> Landmarks:
    """Read a COLMAP model and find out again what its points look like.

    Args:
        model: folder of cameras, images and points3D, as .bin or .txt.
        images: folder of its pictures; may be missing where there is a database.
        database: COLMAP's database.db of the same pictures: nothing is looked for again; by default the
            one beside the model, where `omocap scan` keeps it, if its features are the model's.
        T_object_model: similarity into the object's frame in metres; none, the model is in it.

    Raises:
        InputError: "model-unreadable", "model-points", "model-images", "model-features".
    """
    reconstruction = read_model(model)
    numbers = np.array(sorted(reconstruction.points3D), np.int64)
    if len(numbers) < _MIN_POINTS:
        raise InputError(
            "model-points",
            f"The model has {len(numbers)} points; a phone cannot be found among them.",
            where=str(model),
            fix="Reconstruct the scan again with more pictures, which overlap by two thirds and "
            "show the room around the object too; or give another of COLMAP's models (sparse/0, "
            "sparse/1, ...).",
        )
    points = np.array([reconstruction.points3D[n].xyz for n in numbers.tolist()])
    T = np.eye(4) if T_object_model is None else T_object_model
    chosen = _cover({i: _seen(image, numbers) for i, image in reconstruction.images.items()})
    pictures = [reconstruction.images[i] for i in chosen]
    if database is not None:
        found = _stored(pictures, database)
    else:
        found = _kept_beside(model, pictures) or _found_again(pictures, images, model)
    sightings = tuple(_sightings(found, numbers))
    if sum(len(s.points) for s in sightings) < _MIN_POINTS:
        raise InputError(
            "model-features",
            "Of what the model's points look like, next to nothing is found in its pictures.",
            where=str(database or images),
            fix="Give the pictures that the model was made of, not cropped, turned or resized; or "
            "COLMAP's own database.db.",
        )
    return Landmarks(points @ T[:3, :3].T + T[:3, 3], sightings)


def _seen(image: pycolmap.Image, numbers: Int64[np.ndarray, " points"]) -> set[int]:
    there = [p.point3D_id for p in image.points2D if p.has_point3D()]
    return set(np.searchsorted(numbers, there).tolist())


def _cover(seen: Mapping[int, set[int]]) -> list[int]:
    """Pictures that show most of what those before them do not; all of them if they are few."""
    left = dict(seen)
    chosen: list[int] = []
    missing: set[int] = set()
    while left and len(chosen) < MAX_IMAGES:
        missing = missing or set[int]().union(*left.values())
        best = max(left, key=lambda i: len(left[i] & missing))
        missing = missing - left.pop(best)
        chosen.append(best)
    return chosen


def _kept_beside(
    model: Path, pictures: Sequence[pycolmap.Image]
) -> list[tuple[pycolmap.Image, SiftFeatures]] | None:
    """The features in the folder that holds the model, if the model was made of them."""
    path = model.parent / "database.db"
    if not path.is_file():
        return None
    try:
        found = list(_stored(pictures, path))
    except InputError:
        return None
    fit = all(_made_of(picture, features) for picture, features in found)
    return found if fit and len(found) == len(pictures) else None


def _made_of(picture: pycolmap.Image, features: SiftFeatures) -> bool:
    """Whether features are where the model has them; in straightened pictures they are elsewhere."""
    places = np.array([point.xy for point in picture.points2D])
    same = places.shape == features.pixels.shape
    return same and bool(np.abs(places - features.pixels).max(initial=0) < _SAME)


def _found_again(
    pictures: Sequence[pycolmap.Image], images: Path | None, model: Path
) -> Iterator[tuple[pycolmap.Image, SiftFeatures]]:
    """The features of the pictures' files."""
    missing = [p.name for p in pictures if images is None or not (images / p.name).is_file()]
    if len(missing) > len(pictures) // 2 or images is None:
        raise InputError(
            "model-images",
            f"{len(missing)} of the {len(pictures)} pictures looked for are not there, such as "
            f"{missing[0]}.",
            where=str(images or model),
            fix="Give the folder that COLMAP was given (‹images›), or its database.db.",
        )
    for picture in pictures:
        if picture.name in missing:
            continue
        # COLMAP reads the pixels as they are stored.
        flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
        grey = cv2.imread(str(images / picture.name), flags)
        if grey is None:
            continue
        found = find_features(np.asarray(grey, np.uint8))
        camera = picture.camera
        assert camera is not None
        size = np.array([camera.width, camera.height]) / grey.shape[::-1]
        yield picture, SiftFeatures(found.pixels * size, found.descriptors)


def _stored(
    pictures: Sequence[pycolmap.Image], path: Path
) -> Iterator[tuple[pycolmap.Image, SiftFeatures]]:
    """The features that COLMAP found."""
    with _opened(path) as database:
        known = {image.name: image.image_id for image in database.read_all_images()}
        for picture in pictures:
            if picture.name not in known:
                continue
            descriptors = database.read_descriptors(known[picture.name])
            if descriptors.type != pycolmap.FeatureExtractorType.SIFT:
                raise InputError(
                    "model-database",
                    "The database holds features that are not SIFT.",
                    where=str(path),
                    fix="Leave it out and give the pictures.",
                )
            pixels = database.read_keypoints(known[picture.name])[:, :2].astype(np.float64)
            yield picture, SiftFeatures(pixels, unit(descriptors.data))


@contextmanager
def _opened(path: Path) -> Generator[pycolmap.Database]:
    """A copy of the database, because COLMAP writes into what it opens."""
    if not path.is_file():
        raise InputError("model-database", "There is no such database.", where=str(path))
    pycolmap.logging.minloglevel = pycolmap.logging.Level.FATAL.value
    with TemporaryDirectory(prefix="omocap_features_") as folder:
        copy = Path(folder, path.name)
        try:
            shutil.copyfile(path, copy)
            database = pycolmap.Database.open(copy)
        except RuntimeError as error:
            raise InputError(
                "model-database",
                "It cannot be read as a database of COLMAP.",
                where=str(path),
                fix="Give the database.db of the model's pictures, or leave it out and give the pictures.",
            ) from error
        with database:
            yield database


def _sightings(
    found: Iterable[tuple[pycolmap.Image, SiftFeatures]], numbers: Int64[np.ndarray, " points"]
) -> Iterator[Sighting]:
    """Each picture's features that are where the model has a point."""
    for picture, features in found:
        tracked = [p for p in picture.points2D if p.has_point3D()]
        if not tracked or not len(features.pixels):
            continue
        tree = KDTree(np.array([p.xy for p in tracked]))
        distance, nearest = tree.query(features.pixels)
        at = distance < _AT
        points = np.searchsorted(
            numbers, [tracked[int(k)].point3D_id for k in np.atleast_1d(nearest)[at]]
        )
        yield Sighting(picture.name, points, features.descriptors[at])
