"""A film on a result's clock, with its camera, clamped or watching, in the result's world."""

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from capture_app.overlay.overlay_film import RGB, TimedPictures, Watcher, intrinsics_of, open_film
from capture_app.overlay.placing import FilmPlacement, riding
from capture_app.rerun import unchanged
from capture_app.result import Result, body_of
from ingest.calibration.board.board_lens import distorted
from ingest.film import Turning
from ingest.formats.camera_poses import T_OPENCV_ARKIT_CAMERA
from ingest.formats.registry import read_session
from ingest.mount import Mount, identity_mount
from ingest.mount_file import load_mount
from ingest.session import CaptureSession
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS
from render.backends import Backend
from render.cameras import Camera, quarter_turns
from render.overlay import Distort, OverlayStyle, overlay
from render.props import retimed, rigid_object
from render.third_person import skinned_body
from render.views import Eye, share_shown


def eye_of(result: Result) -> Eye | None:
    """The phone's camera as it rides on the object; None where the object had no phone.

    Raises:
        InputError: the session or the mount is not where it was, or not what it was.
    """
    if result.manifest.options.get("animated"):
        return None
    T_object_phone = inverse(mount_of(result).T_phone_object)
    session = session_of(result)
    if session.intrinsics is None or session.image_size is None:
        return Eye(T_object_phone)
    focal = float(np.median(session.intrinsics[:, :2]))
    return Eye(T_object_phone, 2 * float(np.arctan(np.hypot(*session.image_size) / 2 / focal)))


def mount_of(result: Result) -> Mount:
    """Return T_phone_object; the identity where no file says it.

    Raises:
        InputError: the mount is not where it was, or not what it was.
    """
    given = [item for item in result.manifest.inputs if item.role == "mount"]
    return load_mount(unchanged(given[0])) if given else identity_mount()


def session_of(result: Result) -> CaptureSession:
    """Return what the clamped phone logged.

    Raises:
        InputError: "overlay-no-phone" for an object that moved by itself; the session is not where it
            was, or not what it was.
    """
    if result.manifest.options.get("animated"):
        raise InputError(
            "overlay-no-phone",
            "No phone was clamped to this object; it moved by itself.",
            where=str(result.folder),
            fix="Give the video of a camera that watched, with ‹camera› or ‹board›.",
        )
    log = unchanged(next(item for item in result.manifest.inputs if item.role == "session"))
    format_ = result.manifest.options.get("format")
    return read_session(log, str(format_) if format_ else None)


_SLACK = 0.5 / FPS
"""Seconds that a picture may lie outside the motion: within half a frame of its ends it is there."""


@dataclass(frozen=True)
class Aligned:
    """The pictures of a film that lie within the motion."""

    film: TimedPictures
    first: int
    """Place of the first of them in the film."""
    seconds: Float64[np.ndarray, " pictures"]
    """Seconds of the motion, for each of them; 0 is its frame 0."""
    cameras: list[Camera]
    """What took each of them, in the result's world."""
    lens: Float64[np.ndarray, " coefficients"]
    """OpenCV's distortion; zeros for none."""
    offset: float
    """Seconds that were added to the film's times."""

    @property
    def distort(self) -> Distort | None:
        """What the lens does to directions; None for nothing."""
        lens = self.lens
        return (lambda rays: distorted(rays, lens)) if lens.any() else None

    @property
    def fps(self) -> float:
        """Pictures a second, as most are apart."""
        if len(self.seconds) < 2:
            return FPS
        return 1.0 / float(np.median(np.diff(self.seconds)))


def own_film(result: Result, offset: float = 0.0) -> Aligned:
    """The film of the phone that was clamped to the object.

    Args:
        result: with its inputs where they were.
        offset: seconds to add to what the log says of the time of its pictures.

    Raises:
        InputError: "overlay-no-phone", "no-video", "no-intrinsics", "overlay-no-overlap", or an input
            is not there any more.
    """
    session, moved, mount = session_of(result), result.object_motion, mount_of(result)
    film = open_film(session)
    shift = offset - float(session.times[0]) - moved.start_time
    poses = riding(moved, mount, film.times + shift)
    watcher = Watcher(film, poses, intrinsics_of(session, film), np.zeros(5))
    return watched(result, watcher, FilmPlacement(np.eye(4), shift))


def watched(result: Result, watcher: Watcher, place: FilmPlacement) -> Aligned:
    """The film of a camera that watched.

    Raises:
        InputError: "overlay-no-overlap".
    """
    seconds = watcher.film.times + place.offset
    T_world_camera = place.T_world_rest @ watcher.T_rest_camera @ T_OPENCV_ARKIT_CAMERA
    length = (len(result.object_motion.valid) - 1) / FPS
    inside = np.flatnonzero((seconds > -_SLACK) & (seconds < length + _SLACK))
    if not len(inside):
        raise InputError(
            "overlay-no-overlap",
            f"The film lasts from {seconds[0]:.2f} to {seconds[-1]:.2f} s on the clock of the motion, "
            f"which lasts from 0 to {length:.2f} s.",
            where=str(watcher.film.source),
            fix="Give the right ‹offset›: seconds to add to the film's time to get the motion's.",
        )
    return Aligned(
        film=watcher.film,
        first=int(inside[0]),
        seconds=seconds[inside].clip(0.0, length),
        cameras=[Camera(T_world_camera[k], *watcher.intrinsics[k].tolist()) for k in inside],
        lens=watcher.lens,
        offset=place.offset,
    )


def shown_share(result: Result, sample: int, aligned: Aligned) -> float:
    """Part of the pictures in which any joint of a sample is."""
    nearest = np.rint(aligned.seconds * FPS).astype(int)
    joints = result.people[sample].human.joints[nearest]
    return share_shown(joints, aligned.cameras, *aligned.film.size)


def draw(
    result: Result,
    sample: int,
    aligned: Aligned,
    style: OverlayStyle,
    *,
    backend: Backend = "auto",
    samples: int = 4,
) -> Generator[tuple[int, RGB]]:
    """The film's pictures within the motion, as it says to show them or upright, with a sample in them.

    Each comes with its place among them; those that cannot be read are left out.

    Args:
        result: what was generated.
        sample: index of the person.
        aligned: the film.
        style: its `turns` and `mirrored` are found here.
        backend, samples: see `render.backends.open_renderer`.

    Raises:
        InputError: "object-no-faces", or the film is damaged further on.
    """
    at = aligned.seconds * FPS
    moved = result.object_motion
    # The object is where the film shows it: a guess is not greyed.
    thing = replace(retimed(rigid_object(moved), at, len(moved.valid)), color=None)
    person = retimed(
        skinned_body(result.people[sample].human, body_of(result)), at, len(moved.valid)
    )
    shown = aligned.film.shown
    if shown is None:
        poses = np.stack([camera.T_world_camera for camera in aligned.cameras])
        shown = Turning(quarter_turns(poses))
    filmed = aligned.film.read(aligned.first, aligned.first + len(at))
    return overlay(
        ((place - aligned.first, picture) for place, picture in filmed),
        aligned.cameras,
        person,
        thing,
        distort=aligned.distort,
        fps=aligned.fps,
        style=replace(style, turns=shown.turns, mirrored=shown.mirrored),
        backend=backend,
        samples=samples,
    )
