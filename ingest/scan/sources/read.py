"""read_source: tells what was given for a scan, by its content, and reads it."""

from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from ingest.archive import is_archive, unpack
from ingest.formats.detect import read_session
from ingest.scan.frames import FEWEST
from ingest.scan.sources.mesh_parts import SUFFIXES as MESHES
from ingest.scan.sources.model import model_in, model_source
from ingest.scan.sources.session import session_source
from ingest.scan.sources.stills import HEIC, Stills
from ingest.scan.sources.video import SUFFIXES as VIDEOS
from ingest.scan.sources.video import video_source
from ingest.scan.types import ScanSource
from omomo_core.errors import InputError

_PHOTOS_ALONE = ("session-no-metres", "log-no-times")
"""What is wrong with logs that lie beside good pictures: `transforms.json` as COLMAP's users have it."""
_PHOTO_SUFFIXES = (".jpg", ".jpeg", ".png", *HEIC)
_EXIF, _FOCAL_35MM = 0x8769, 0xA405
"""Numbers of the EXIF block and of FocalLengthIn35mmFilm in it (EXIF 2.3)."""
_FILM_DIAGONAL = np.hypot(36.0, 24.0)
"""Millimetres; phones state the focal length with the same angle across the diagonal."""


def is_mesh(path: Path) -> bool:
    """Whether it is a ready mesh, for `read_scan_mesh`, by its name."""
    return path.suffix.lower() in MESHES


def mesh_in(path: Path) -> Path | None:
    """The mesh that was given: the file, or the largest one in a folder that has its pictures beside it.

    Args:
        path: of any source; an archive is unpacked.

    Returns:
        None where it is something else: a phone's session, a COLMAP model, or enough photos.

    Raises:
        InputError: of `unpack`.
    """
    if is_mesh(path):
        return path
    folder = unpack(path) if path.is_file() and is_archive(path) else path
    if not folder.is_dir() or model_in(folder) is not None:
        return None
    files = sorted((*folder.glob("*"), *folder.glob("*/*")))
    meshes = [file for file in files if is_mesh(file) and file.is_file()]
    if not meshes or sum(file.suffix.lower() in _PHOTO_SUFFIXES for file in files) >= FEWEST:
        return None
    try:
        read_session(path)
    except InputError as error:
        if error.code == "session-unknown":
            return max(meshes, key=lambda file: file.stat().st_size)
    return None


def read_source(
    path: Path, *, images: Path | None = None, poses: bool = True, app: str | None = None
) -> ScanSource:
    """Read what the object was filmed with.

    Args:
        path: session (folder or archive), folder or archive of photos, video, or COLMAP model (its
            folder, or the one around it).
        images: folder of the pictures of a COLMAP model, where they are not beside it.
        poses: whether logged poses are wanted; without, a log whose poses or times say nothing in
            metres or seconds is a folder of photos.
        app: name of a format: read it as a session of that app, whatever it looks like; None finds
            out what it is.

    Raises:
        InputError: "scan-missing"; "scan-unknown" for none of these; those of what it is.
    """
    if not path.exists():
        raise InputError(
            "scan-missing",
            "There is no such file or folder.",
            where=str(path),
            fix="Check the path.",
        )
    if app is None and path.is_file() and path.suffix.lower() in VIDEOS:
        return video_source(path)
    folder = unpack(path) if path.is_file() and is_archive(path) else path
    if app is None and folder.is_dir() and (model := model_in(folder)) is not None:
        return model_source(model, images)
    try:
        session = read_session(path, app)
    except InputError as error:
        unknown = app is None and error.code == "session-unknown"
        if unknown or (error.code in _PHOTOS_ALONE and not poses):
            return _photos(folder, path)
        raise _with_a_way_out(error) from error
    return session_source(session)


def _with_a_way_out(error: InputError) -> InputError:
    """The error with one more fix: to scan from the pictures alone."""
    if error.code not in _PHOTOS_ALONE:
        return error
    fix = f"{error.fix} Or use the pictures alone (--no-poses) and give the object's height (--height "
    fix += "0.95), a length (--length) or a board (--board A4)."
    return InputError(error.code, error.what, where=error.where, fix=fix)


def _photos(folder: Path, path: Path) -> ScanSource:
    """The folder's photos, or those of the one folder in it that has some."""
    inside = [sub for sub in sorted(folder.iterdir()) if sub.is_dir()] if folder.is_dir() else []
    found = [place for place in (folder, *inside) if _photos_in(place)]
    if found:
        return _photos_source(max(found, key=lambda place: len(_photos_in(place))))
    raise InputError(
        "scan-unknown",
        "There is nothing here that a scan can be made of.",
        where=str(path),
        fix="Give a phone's session with pictures, a folder of photos "
        f"({', '.join(_PHOTO_SUFFIXES)}), a video ({', '.join(VIDEOS)}), a COLMAP model, or a mesh "
        f"({', '.join(MESHES)}).",
    )


def _photos_in(folder: Path) -> list[Path]:
    """The photos of a folder in the order of their names, hidden files left out."""
    files = folder.iterdir() if folder.is_dir() else ()
    return sorted(
        file
        for file in files
        if file.suffix.lower() in _PHOTO_SUFFIXES
        and not file.name.startswith(".")
        and file.is_file()
    )


def _photos_source(folder: Path) -> ScanSource:
    """The photos in a folder, turned upright as they say."""
    files = tuple(_photos_in(folder))
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
