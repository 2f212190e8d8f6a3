"""From what a user says of a film to the overlay of a result in it."""

from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from capture_app.commands.overlay import OverlayRequest
from capture_app.overlay.aligned import (
    Aligned,
    draw,
    mount_of,
    own_film,
    session_of,
    shown_share,
    watched,
)
from capture_app.overlay.overlay_film import RGB, Watcher, by_phone, on_tripod, pose_in
from capture_app.overlay.placing import (
    FilmPlacement,
    arkit_world,
    board_in_room,
    by_board_in_room,
    by_board_on_object,
    by_scan,
    clock_offset,
)
from capture_app.progress import Progress
from capture_app.result import Result, load_result, sample_index
from capture_app.solve_samples import solved_result
from ingest.archive import is_archive
from ingest.calibration.board.board_place import load_place, parse_grid
from ingest.calibration.board.board_spec import Board, Checkerboard
from ingest.calibration.board.board_track import BoardTrack, track_session, track_video
from ingest.calibration.board.camera_file import load_camera
from ingest.calibration.hand_eye.to_mount import stream_of
from ingest.calibration.pose_file import load_pose
from ingest.formats.registry import FORMATS, read_session
from ingest.session import CaptureSession
from ingest.session_images import left_out
from omomo_core.errors import InputError
from omomo_core.whole_file import check_target
from render.overlay import OverlayStyle
from render.video import write_moving


def find(result: Result, request: OverlayRequest, progress: Progress) -> Aligned:
    """The film on the result's clock, with its camera in the result's world.

    Args:
        result: what was generated.
        request: what the user says of the film and its camera.
        progress: called with the stage "board" or "localise".

    Raises:
        InputError: the film, its camera or its place cannot be known; see the parts.
    """
    if request.video is None:
        return own_film(result, request.offset or 0.0)
    if _is_session(request.video):
        return _second_phone(result, request, read_session(request.video), progress)
    return _tripod(result, request, request.video, progress)


def _is_session(path: Path) -> bool:
    """Whether it is what a phone logged, be it a folder, an archive or a file of poses."""
    return path.is_dir() or (
        path.is_file() and (is_archive(path) or any(app.detect(path) for app in FORMATS))
    )


def _tripod(result: Result, request: OverlayRequest, video: Path, progress: Progress) -> Aligned:
    camera = load_camera(request.camera) if request.camera else None
    if request.board:
        board = parse_grid(request.board)
        track = track_video(video, board, camera, progress=progress)
        watcher = on_tripod(video, track.camera)
        if request.board_at == "object":
            return watched(result, watcher, _by_board_on_object(result, request, board, track))
        return _rested(result, request, watcher, _by_board_in_room(result, request, board, track))
    if camera is None or request.camera is None:
        raise InputError(
            "camera-needed",
            "Nothing says what the camera of this video is, nor where it stood.",
            where=str(video),
            fix="Give ‹camera› FILE.json with fx, fy, cx, cy and T_world_camera; or ‹board› with the "
            "board that it filmed.",
        )
    T_world_camera = pose_in(request.camera)
    watcher = on_tripod(video, camera, None if request.scan else T_world_camera)
    if request.scan:
        T = by_scan(request, result.object_motion, watcher, progress)
        return _rested(result, request, watcher, T)
    if T_world_camera is None:
        raise InputError(
            "camera-place-needed",
            "The camera file does not say where the camera stood.",
            where=str(request.camera),
            fix='Add "T_world_camera", four rows of four numbers in the result\'s world; or give '
            "‹board› with the board that it filmed, or ‹scan› with a scan of the place.",
        )
    return _rested(result, request, watcher, T_world_camera)


def _rested(
    result: Result,
    request: OverlayRequest,
    watcher: Watcher,
    T_world_camera: Float64[np.ndarray, "4 4"],
) -> Aligned:
    """The film of a camera that stood there; its clock by what moves in it, if it is not given."""
    offset = request.offset
    if offset is None:
        fx, fy, cx, cy = watcher.intrinsics[0]
        K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        moved = result.object_motion
        offset = clock_offset(watcher.film, moved, T_world_camera, K, watcher.lens)
    return watched(result, watcher, FilmPlacement(T_world_camera, offset))


def _second_phone(
    result: Result, request: OverlayRequest, session: CaptureSession, progress: Progress
) -> Aligned:
    watcher = by_phone(session)
    if request.board:
        board = parse_grid(request.board)
        track = track_session(session, board, progress=progress)
        if request.board_at == "object":
            return watched(result, watcher, _by_board_on_object(result, request, board, track))
        T_world_rest = _by_board_in_room(result, request, board, track)
    elif request.scan:
        T_world_rest = by_scan(request, result.object_motion, watcher, progress)
    elif request.shared_world:
        T_world_rest = arkit_world(result.object_motion, session_of(result), mount_of(result))
    else:
        raise InputError(
            "camera-place-needed",
            "Nothing says where the second phone was.",
            where=str(session.source),
            fix="Add ‹shared_world› if both phones logged in one ARKit world; or give ‹board› with "
            "the board that it filmed, or ‹scan› with a scan of the place.",
        )
    return watched(result, watcher, FilmPlacement(T_world_rest, _offset(request)))


def _by_board_on_object(
    result: Result, request: OverlayRequest, board: Board | Checkerboard, track: BoardTrack
) -> FilmPlacement:
    where = request.board_place
    T_object_board = load_place(where, board).T_object_board if where else None
    return by_board_on_object(result.object_motion, track, T_object_board, request.offset)


def _by_board_in_room(
    result: Result, request: OverlayRequest, board: Board | Checkerboard, track: BoardTrack
) -> Float64[np.ndarray, "4 4"]:
    """T_world_rest of what saw the board."""
    where = request.board_place
    T_world_board = load_pose(where) if where else _seen_by_phone(result, board)
    return by_board_in_room(T_world_board, stream_of(track).T)


def _seen_by_phone(result: Result, board: Board | Checkerboard) -> Float64[np.ndarray, "4 4"]:
    session = session_of(result)
    T_world_arkit = arkit_world(result.object_motion, session, mount_of(result))
    return board_in_room(T_world_arkit, stream_of(track_session(session, board)).T)


def _offset(request: OverlayRequest) -> float:
    if request.offset is None:
        raise InputError(
            "offset-needed",
            "Nothing shows how the film's clock and that of the motion hang together.",
            field="offset",
            fix="Give ‹offset› SECONDS: what to add to the film's time to get the motion's, such as "
            "the time in the motion minus that in the film at which the object leaves the floor.",
        )
    return request.offset


VIDEO_FORMATS = (".mp4", ".webp", ".gif")


@dataclass(frozen=True)
class Overlaid:
    """The film that was drawn, and what was found out on the way."""

    offset: float | None
    """Seconds that were added to the film's time; None where they were known."""
    notes: tuple[str, ...]
    """In sentences."""
    person_shown: float
    """Part of the pictures in which the person is."""


FEW = 0.1
"""Part of a film's pictures with the person in it below which it is said that they are hardly seen."""


def overlay_result(
    request: OverlayRequest, progress: Progress, say: Callable[[str], None] | None = None
) -> Overlaid:
    """Draw it into a file that appears whole or not at all.

    Args:
        request: what to draw.
        progress: called with the stages "board" or "localise", and "video".
        say: told, before anything is drawn, that the film hardly shows the person.

    Raises:
        InputError: see `find` and `draw`, or the file cannot be written.
    """
    check_target(request.output, VIDEO_FORMATS)
    result = load_result(request.result)
    index = sample_index(result, request.sample)
    result = solved_result(result, [index], progress)
    aligned = find(result, request, progress)
    person_shown = shown_share(result, index, aligned)
    if say is not None and person_shown < FEW:
        say(_unseen(request, person_shown, len(aligned.seconds)))
    pictures = draw(
        result,
        index,
        aligned,
        OverlayStyle(request.object_style, request.opacity, request.wipe),
        backend=request.backend,
        samples=4 if request.smooth else 0,
    )
    drawn: list[int] = []
    write_moving(request.output, _counted(pictures, aligned, drawn, progress), aligned.fps)
    lacking = _left_out(aligned, drawn, len(aligned.seconds))
    return Overlaid(*_told(request, aligned, lacking), person_shown)


def _unseen(request: OverlayRequest, share: float, count: int) -> str:
    """The sentence on a film that hardly shows the person."""
    seen = f"The person is in {round(share * count)} of the film's {count} pictures"
    if request.video is not None:
        return f"{seen}: the camera looks elsewhere, or its place or ‹offset› is wrong."
    return (
        f"{seen}: the phone on the object looks away from who moves it. Give the film of another "
        "camera (‹video›) to see them."
    )


def _counted(
    pictures: Iterable[tuple[int, RGB]], aligned: Aligned, drawn: list[int], progress: Progress
) -> Generator[RGB]:
    """The pictures, while their places are noted; nothing is written where too many are damaged."""
    count = len(aligned.seconds)
    for place, picture in pictures:
        drawn.append(place)
        progress("video", (place + 1) / count)
        yield picture
    _left_out(aligned, drawn, count)


def _left_out(aligned: Aligned, drawn: Sequence[int], count: int) -> str:
    """The sentence on pictures that could not be read, see `left_out`."""
    film, first = aligned.film, aligned.first
    names = [film.name(first + k) for k in sorted({*range(count)} - {*drawn})]
    return left_out(names, count, film.source)


def _told(
    request: OverlayRequest, aligned: Aligned, lacking: str
) -> tuple[float | None, tuple[str, ...]]:
    """The offset that was found, and what else is worth a word."""
    offset = aligned.offset if request.video is not None and request.offset is None else None
    notes = [] if offset is None else [f"The film begins at ‹offset› {offset:.2f} of the motion."]
    if (lost := aligned.film.lost) > 1:
        notes.append(
            f"The film lacks {lost} of the images that its log lists; its stamps say which."
        )
    if lacking:
        notes.append(lacking)
    return offset, tuple(notes)
