"""read_source: tells what was given for a scan, by its content, and reads it."""

from pathlib import Path

from ingest.archive import is_archive, unpack
from ingest.formats.detect import read_session
from ingest.scan.sources.mesh import SUFFIXES as MESHES
from ingest.scan.sources.model import model_in, model_source
from ingest.scan.sources.photos import SUFFIXES as PHOTOS
from ingest.scan.sources.photos import photos_in, photos_source
from ingest.scan.sources.session import session_source
from ingest.scan.sources.video import SUFFIXES as VIDEOS
from ingest.scan.sources.video import video_source
from ingest.scan.types import ScanSource
from omomo_core.errors import InputError

_PHOTOS_ALONE = ("session-no-metres", "log-no-times")
"""What is wrong with logs that lie beside good pictures: `transforms.json` as COLMAP's users have it."""


def is_mesh(path: Path) -> bool:
    """Whether it is a ready mesh, for `read_scan_mesh`, by its name."""
    return path.suffix.lower() in MESHES


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
    """What a scan can do without, and a take cannot."""
    if error.code not in _PHOTOS_ALONE:
        return error
    fix = f"{error.fix} Or use the pictures alone (--no-poses) and give the object's height (--height "
    fix += "0.95), a length (--length) or a board (--board A4)."
    return InputError(error.code, error.what, where=error.where, fix=fix)


def _photos(folder: Path, path: Path) -> ScanSource:
    """The folder's photos, or those of the one folder in it that has some."""
    inside = [sub for sub in sorted(folder.iterdir()) if sub.is_dir()] if folder.is_dir() else []
    found = [place for place in (folder, *inside) if photos_in(place)]
    if found:
        return photos_source(max(found, key=lambda place: len(photos_in(place))))
    raise InputError(
        "scan-unknown",
        "There is nothing here that a scan can be made of.",
        where=str(path),
        fix="Give a phone's session with pictures, a folder of photos "
        f"({', '.join(PHOTOS)}), a video ({', '.join(VIDEOS)}), a COLMAP model, or a mesh "
        f"({', '.join(MESHES)}).",
    )
