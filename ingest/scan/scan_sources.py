"""What is given for a scan: a session, a film, photos or a model, read as pictures with cameras."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import av
import numpy as np
from jaxtyping import Float32, Float64
from PIL import Image, UnidentifiedImageError

from ingest.archive import is_archive, unpack
from ingest.film import Film, film_at, frames_of
from ingest.formats.camera_poses import opencv_poses
from ingest.formats.registry import read_session
from ingest.scan.mesh_sources import SUFFIXES as MESHES
from ingest.scan.mesh_sources import model_in, model_source
from ingest.scan.scan_pictures import FEWEST, HEIC, MAX_PIXELS, Stills
from ingest.scan.scan_types import Colours, Grey, Pictures, ScanSource
from ingest.session import CaptureSession
from ingest.session_images import film_and_pairs, image_times
from omomo_core.errors import InputError

SUFFIXES = (".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm")


@dataclass(frozen=True)
class VideoFrames:
    """The pictures of a video, by number."""

    path: Path
    names: tuple[str, ...]
    turns: int = 0
    """Quarter turns counter-clockwise that bring its frames upright."""
    frames: tuple[int, ...] | None = None
    """Place of each picture in the film; None where all are in step."""

    def greys(self, wanted: Sequence[int], width: int) -> Iterator[tuple[int, Grey]]:
        """Some of them, small; see `Pictures`."""
        for index, frame in self._frames(wanted):
            scale = min(1.0, width / max(frame.width, frame.height))
            size = max(1, round(frame.width * scale)), max(1, round(frame.height * scale))
            small = frame.reformat(*size, format="gray", interpolation="AREA")
            yield index, np.ascontiguousarray(np.rot90(small.to_ndarray(), self.turns))

    def colours(self, wanted: Sequence[int]) -> Iterator[tuple[int, Colours]]:
        """Some of them as they are; see `Pictures`."""
        for index, frame in self._frames(wanted):
            yield (
                index,
                np.ascontiguousarray(np.rot90(frame.to_ndarray(format="rgb24"), self.turns)),
            )

    def _frames(self, wanted: Sequence[int]) -> Iterator[tuple[int, av.VideoFrame]]:
        if self.frames is None:
            yield from frames_of(self.path, wanted)
            return
        number = {self.frames[k]: k for k in wanted}
        for place, frame in frames_of(self.path, list(number)):
            yield number[place], frame


def video_source(path: Path) -> ScanSource:
    """A plain video, turned upright as it says.

    A film that is to be shown mirrored, as front cameras make them, is not mirrored here: what the camera
    saw is what there is, and a mesh of what a mirror shows would be mirrored too.

    Raises:
        InputError: "no-video" or "video-large".
    """
    film = _bounded(film_at(path))
    pictures = VideoFrames(path, _numbered(range(len(film.stamps))), film.upright_turns)
    return ScanSource("video", path, pictures, times=film.times)


def _numbered(numbers: Iterable[int]) -> tuple[str, ...]:
    return tuple(f"{k:05d}" for k in numbers)


def _bounded(film: Film) -> Film:
    pixels = film.size[0] * film.size[1]
    if pixels > MAX_PIXELS:
        raise InputError(
            "video-large",
            f"{film.path.name} has {pixels / 1e6:.0f} megapixels a frame.",
            where=str(film.path),
            fix="Film in 4K or less.",
        )
    return film


_SAME_TIME = 0.05
"""Seconds between a picture and what belongs to it, at most."""


def session_source(session: CaptureSession) -> ScanSource:
    """The pictures of a session with the poses of their moments.

    Poses are NaN where the phone says that it did not know them.

    Raises:
        InputError: "scan-no-pictures" when the app saved none, or what `film_and_pairs` refuses.
    """
    pictures, times = _pictures(session)
    pose = _nearest(session.times, times)
    T = opencv_poses(session.T_world_phone[pose])
    lost = np.abs(session.times[pose] - times) > _SAME_TIME
    if session.tracking_ok is not None:
        lost |= ~session.tracking_ok[pose]
    T[lost] = np.nan
    known = session.intrinsics is not None and session.image_size is not None
    return ScanSource(
        kind="session",
        where=session.source,
        pictures=pictures,
        image_size=session.image_size if known else None,
        intrinsics=session.intrinsics[pose] if known and session.intrinsics is not None else None,
        T_world_camera=T,
        upright=session.gravity_aligned,
        times=times,
        depth=_depth(session, times),
    )


def _pictures(
    session: CaptureSession,
) -> tuple[Pictures, Float64[np.ndarray, " pictures"]]:
    """The pictures of a session, and when they were taken."""
    turns, times = session.image_turns % 4, image_times(session)
    if session.images is not None:
        names = tuple(file.stem for file in session.images)
        return Stills(session.images, names, turns), times[: len(names)]
    if session.video is not None:
        film, pairs = film_and_pairs(session, session.video)
        names, frames = _numbered(pairs.images.tolist()), tuple(pairs.frames.tolist())
        return VideoFrames(_bounded(film).path, names, turns, frames), times[pairs.images]
    raise InputError(
        "scan-no-pictures",
        f"The session of {session.app} holds no pictures and no video.",
        where=str(session.source),
        fix="Film the object with an app that saves what it sees, such as Stray Scanner, 3D Scanner "
        "App (All Data) or Record3D; or give a plain video.",
    )


def _nearest(
    times: Float64[np.ndarray, " log"], wanted: Float64[np.ndarray, " wanted"]
) -> np.ndarray:
    """The entry of a log that is nearest in time."""
    after = np.searchsorted(times, wanted).clip(1, max(1, len(times) - 1))
    before = after - 1
    after = after.clip(max=len(times) - 1)
    return np.where(wanted - times[before] <= times[after] - wanted, before, after)


def _depth(
    session: CaptureSession, times: Float64[np.ndarray, " pictures"]
) -> Callable[[int], Float32[np.ndarray, "height width"] | None] | None:
    log = session.depth
    if log is None or not len(log.times):
        return None
    nearest = _nearest(log.times, times)

    def load(picture: int) -> Float32[np.ndarray, "height width"] | None:
        k = int(nearest[picture])
        if abs(log.times[k] - times[picture]) > _SAME_TIME:
            return None
        return np.ascontiguousarray(np.rot90(log.load(log.files[k]), session.image_turns))

    return load


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
    if app is None and path.is_file() and path.suffix.lower() in SUFFIXES:
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
    fix = f"{error.fix} Or use the pictures alone (‹no poses›) and give the object's height (‹height› "
    fix += "0.95), a length (‹length›) or a board (‹board› A4)."
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
        f"({', '.join(_PHOTO_SUFFIXES)}), a video ({', '.join(SUFFIXES)}), a COLMAP model, or a mesh "
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
