"""Steps of the guide in which something is recorded, and quick checks of what was recorded."""

from collections.abc import Callable, Iterator
from itertools import islice, takewhile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app.calibration.guide_steps import (
    AgainError,
    Finding,
    GuideState,
    GuideStep,
    Prompt,
    Words,
    both,
)
from ingest.calibration.board.board_detect import Corners, Detector, Grey, fits, not_found
from ingest.calibration.board.board_spec import MIN_CORNERS, Board
from ingest.calibration.board.board_track import TIMES, Picture, of_folder, of_session, of_video
from ingest.calibration.board.camera_file import load_camera
from ingest.calibration.hand_eye.hand_eye import check_turns
from ingest.calibration.hand_eye.hand_eye_model import PoseStream
from ingest.calibration.hand_eye.to_mount import phone_stream, read_pose_log
from ingest.calibration.pose_file import load_pose
from ingest.calibration.scan_mount import views_of
from ingest.calibration.still import CARRIED, clamped_stills
from ingest.formats.registry import read_session
from ingest.session import CaptureSession
from ingest.trajectory.segments import check_rate, find_breaks
from omomo_core.errors import InputError

_SECOND_TURN = np.radians(10.0)
"""Turned less about a second direction, it says next to nothing of the place along the first."""
_ENOUGH = 15.0
"""Seconds of turning that a mount is well known from."""
_LOST = 0.2
"""Part of a recording that may be lost to breaks without a word."""
_MOST_POSES = 600
"""Poses that turns are measured with."""


def turned_recording(session: CaptureSession) -> Finding:
    """Judge the recording of a motion that another camera or tracker followed, too.

    Raises:
        InputError: "rate-too-low", "calibration-tracking" or "calibration-turns".
    """
    check_rate(session)
    stream = phone_stream(session)
    check_turns(stream)
    whole, used = float(np.ptp(session.times)), float(np.ptp(stream.times))
    doubts: list[str] = []
    if used < min((1 - _LOST) * whole, _ENOUGH):
        doubts.append(
            f"Only {used:.0f} s without a break can be used. Record again where there is light and "
            "much to see, for 20 s or more, and move more slowly."
        )
    tracked = "without a break" if used > whole - 0.5 else f"without a break for {used:.0f} s"
    turns = turns_of(stream)
    return both(
        Finding(f"{_pace(session)}, tracked {tracked}", tuple(doubts)),
        turns,
    )


def turns_of(stream: PoseStream) -> Finding:
    """Return by how much the phone turned, and about how many directions."""
    R = Rotation.from_matrix(stream.T[:: max(1, len(stream.T) // _MOST_POSES), :3, :3])
    vectors = (R.mean().inv() * R).as_rotvec()
    axes = np.linalg.svd(vectors - vectors.mean(axis=0), full_matrices=False)[2]
    first, second, _ = np.ptp(vectors @ axes.T, axis=0).tolist()
    if second > _SECOND_TURN:
        return Finding(
            f"turned by up to {np.degrees(first):.0f} deg, and by {np.degrees(second):.0f} about a "
            "second direction"
        )
    return Finding(
        f"turned by up to {np.degrees(first):.0f} deg",
        (
            "It turned about one direction only: where the object is along that direction stays "
            "open (its height, if it was pushed over the floor). Record again and also tilt it by 20 "
            "degrees in two directions; or go on, and let the floor tell the height.",
        ),
    )


def rested_recording(session: CaptureSession) -> Finding:
    """Judge the recording of a phone that was clamped while the log ran and the object stood still.

    Raises:
        InputError: "rate-too-low" or "no-still".
    """
    return _rests(session, CARRIED)


def filmed_rest(session: CaptureSession) -> Finding:
    """Judge the recording of a clamped phone whose pictures at rest are looked for in a scan.

    Raises:
        InputError: "rate-too-low", "no-still", "scan-no-pictures" or "scan-no-camera".
    """
    rests = _rests(session, 0.0)
    stills, _ = clamped_stills(session)
    views = [view for still in stills for view in views_of(session, still).views]
    height, width = views[0].picture.shape
    return both(rests, Finding(f"{len(views)} pictures of {width} x {height} there"))


def pictured_recording(session: CaptureSession) -> Finding:
    """Judge the recording of a phone that filmed a board before it was clamped.

    Raises:
        InputError: of `rested_recording`, "no-intrinsics" or "no-video".
    """
    rests = rested_recording(session)
    if session.intrinsics is None:
        raise InputError(
            "no-intrinsics",
            f"{session.app} does not log the camera's focal length.",
            where=str(session.source),
            fix="Record with an app that does, such as Stray Scanner or 3D Scanner App.",
        )
    if session.video is None and not session.images:
        raise InputError(
            "no-video",
            "The recording holds no film and no pictures of the board.",
            where=str(session.source),
            fix="Record with an app that films while it logs, such as Stray Scanner.",
        )
    return rests


def _rests(session: CaptureSession, path: float) -> Finding:
    check_rate(session)
    stills, note = clamped_stills(session, path=path)
    rests_text = " and again ".join(f"from {still}" for still in stills)
    doubts = (note,) if note else ()
    if find_breaks(session).jumps.any():
        doubts += (
            "ARKit's tracking jumped during the recording: what lies on both sides of a jump may "
            "not fit together. Move more slowly, where there is light and much to see.",
        )
    return Finding(f"{_pace(session)}, the clamped phone rests {rests_text}", doubts)


def _pace(session: CaptureSession) -> str:
    """App, poses a second, seconds."""
    rate = 1 / float(np.median(np.diff(session.times)))
    return f"{session.app}, {rate:.0f} poses a second, {np.ptp(session.times):.0f} s"


_RATE = 2.0
"""Pictures of a film that are looked at, per second."""
_SECONDS = 30.0
"""The beginning of a film that is looked at, seconds."""
_MOST_PICTURES = 60
"""Most pictures of a film that are looked at."""
_OFTEN = 0.5
"""Share of the pictures that should show a board that is filmed all the time."""
_BEFORE_CLAMPING = 0.25
"""Share of the pictures that should show a board that is filmed before the phone is clamped."""
_SAMPLES = 4
"""Pictures in which the reason is looked for why the board is not found."""


def filmed_board(path: Path, board: Board) -> Finding:
    """The board in what a second camera recorded.

    Args:
        path: a video, a folder of pictures with times.csv, or a phone's session.
        board: as printed.

    Raises:
        InputError: of what is read, or of `ingest.calibration.board.board_detect.not_found`.
    """
    return _seen(_pictures(path), board, str(path))


def filmed_by_phone(session: CaptureSession, board: Board, before: float) -> Finding:
    """The board in what the phone itself filmed; raises as `filmed_board`.

    Args:
        session: the phone's log.
        board: as printed.
        before: seconds from the start of the log when the phone was clamped.
    """
    start = session.times[0]
    pictures = of_session(session, _RATE, _silent)
    filming = takewhile(lambda picture: picture.time < start + before, pictures)
    return _seen(filming, board, str(session.source), often=_BEFORE_CLAMPING)


def filmed_then_clamped(session: CaptureSession, board: Board) -> Finding:
    """A board that the phone filmed before it was clamped.

    Raises:
        InputError: of `pictured_recording`, or as `filmed_board`.
    """
    rests = pictured_recording(session)
    clamped = clamped_stills(session, path=CARRIED)[0][0].start
    film = filmed_by_phone(session, board, clamped)
    return Finding(f"{rests.good}; {film.good}", rests.doubts + film.doubts)


def _pictures(path: Path) -> Iterator[Picture]:
    if path.is_file():
        return of_video(path, _RATE, _silent)
    if (path / TIMES).is_file():
        return of_folder(path, _silent)
    return of_session(read_session(path), _RATE, _silent)


def _seen(
    pictures: Iterator[Picture], board: Board, where: str, *, often: float = _OFTEN
) -> Finding:
    detector = Detector(board)
    some: list[Grey] = []
    showing: list[Grey] = []
    corners: list[int] = []
    for picture in islice(_beginning(pictures), _MOST_PICTURES):
        detected = detector.find(picture.grey)
        if len(corners) % _SAMPLES == 0:
            some.append(picture.grey)
        if _enough(detected) and len(showing) < _SAMPLES:
            showing.append(picture.grey)
        corners.append(len(detected.numbers) if _enough(detected) else 0)
    if not some:
        raise InputError("no-video", "There are no pictures.", where=where, fix="Film the board.")
    if not fits(showing, board):
        raise not_found(showing or some[:: -(-len(some) // _SAMPLES)], board, where)
    return _told(corners, board, some[0], often)


def _told(corners: list[int], board: Board, picture: Grey, often: float) -> Finding:
    """Return the positions of the corners in each picture; none where there were too few of them."""
    shown = sum(count > 0 for count in corners)
    part = sum(corners) / shown / len(board.corners)
    counts = (
        f"{picture.shape[1]} x {picture.shape[0]}; of {len(corners)} pictures at its beginning "
        f"{shown} show the board, with {part:.0%} of its corners"
    )
    if shown >= often * len(corners):
        return Finding(counts)
    return Finding(
        counts,
        (
            "The others miss the board. Bring it nearer, light it well, and keep all of it in the "
            "picture.",
        ),
    )


def _beginning(pictures: Iterator[Picture]) -> Iterator[Picture]:
    first = next(pictures, None)
    if first is None:
        return
    yield first
    yield from takewhile(lambda picture: picture.time < first.time + _SECONDS, pictures)


def _enough(corners: Corners) -> bool:
    return len(corners.numbers) >= MIN_CORNERS


def _silent(name: str, done: float) -> None:
    """Nobody is told how far a quick look is."""


def _recording(check: Callable[[CaptureSession, GuideState], Finding], *words: str):
    """Return a question for a recording that passes a check."""

    def ask(prompt: Prompt, state: GuideState) -> Words:
        path = prompt.path("Folder or archive of the recording", state.session_file)
        session = read_session(path)
        if not prompt.accept(check(session, state)):
            raise AgainError
        state.session_file, state.session = path, session
        return [*words, str(path)]

    return ask


_CLAMP = "clamp the phone to the object without stopping the log. Keep the lens uncovered."
_REST = (
    "Let go: leave object and phone alone for two seconds, where the object still stands as before."
)
_END = (
    "If you go on to move the object in the same recording, put it back on its mark at the end and "
    "leave it alone for two seconds: that tells whether the phone slipped. Then stop."
)
_MARK = (
    "Put the object where there is light and much to see, and mark on the floor where it stands."
)
_TURN = (
    "Let the object stand on the floor for two seconds with nobody touching it, so that the floor "
    "can help later. Then turn it for 20 seconds by 30 to 60 degrees about two directions (let it "
    "nod, and shake its head), not too fast. A thing that can only be pushed will do, but its height "
    "stays open then.",
    "Put it down, leave it alone for two seconds, and stop both.",
)

SCANNED = GuideStep(
    "Record",
    (
        _MARK,
        "Start the log, in an app that logs ten poses a second or more and gives a mesh of the same "
        "recording in the same world (3D Scanner App with All Data if it is that fast; Stray Scanner, "
        "if you make the mesh from its depth maps).",
        "Walk round the object twice, at knee height and above it, with the room in the picture too. "
        "Do not move the object.",
        f"Then {_CLAMP}",
        _REST,
        _END,
    ),
    _recording(lambda session, _: rested_recording(session)),
    ("RECORDING",),
)
FILMED = GuideStep(
    "Record",
    (
        _MARK,
        "Start the log, in an app that films while it logs (Stray Scanner).",
        "Film the board on the object from several sides for ten seconds, from half a metre away, "
        "then walk once round the object.",
        f"Then {_CLAMP}",
        _REST,
        _END,
    ),
    _recording(lambda session, state: filmed_then_clamped(session, state.printed)),
    ("RECORDING",),
)
STOOD = GuideStep(
    "Record",
    (
        "Put the object where it stood when it was scanned, in the same place and the same light: "
        "what the clamped phone looks at must be in the scan.",
        "Clamp the phone, and start the log in an app that films while it logs (Stray Scanner, "
        "Record3D).",
        _REST,
        _END,
    ),
    _recording(lambda session, _: filmed_rest(session), "--session"),
    ("--session", "RECORDING"),
)
WITNESSED = GuideStep(
    "Record",
    (
        "Put the second camera on a tripod, one to two metres away, so that the board fills a third "
        "of the picture. Lock its focus, its zoom and its exposure; switch off mirroring.",
        "Clamp the phone, with its back camera towards a lit room with much to see. Start its log, "
        "then the film of the second camera. Their clocks need not agree.",
        *_TURN,
    ),
    _recording(lambda session, _: turned_recording(session)),
    ("RECORDING",),
)
TRACKED = GuideStep(
    "Record",
    (
        "Fix the markers or the tracker to the object, and the phone to the object, so that nothing "
        "gives.",
        "Start both logs. Their clocks need not agree.",
        *_TURN,
    ),
    _recording(lambda session, _: turned_recording(session)),
    ("RECORDING",),
)


def _ask_film(prompt: Prompt, state: GuideState) -> Words:
    path = prompt.path("What the second camera recorded: a video, or a second phone's session")
    prompt.tell("Looking at it...")
    if not prompt.accept(filmed_board(path, state.printed)):
        raise AgainError
    question = "File with that camera's intrinsics (Enter: they are found from the film)"
    return [str(path), *_optional(prompt, question, "--camera", load_camera)]


FILM = GuideStep("The film", (), _ask_film, ("FILM",))


def _ask_poses(prompt: Prompt, state: GuideState) -> Words:
    path = prompt.path("The tracker's log: lines of t x y z qx qy qz qw")
    stream = read_pose_log(path)
    rate = 1 / float(np.median(np.diff(stream.times)))
    seconds = float(np.ptp(stream.times))
    prompt.good(f"{len(stream.times):,} poses, {rate:.0f} a second, {seconds:.0f} s")
    question = "File with the tracked body's pose on the mesh (Enter: it has the mesh's frame)"
    return [str(path), *_optional(prompt, question, "--body", load_pose)]


def _optional(prompt: Prompt, question: str, option: str, load: Callable[[Path], object]) -> Words:
    """A file that there may be, once it can be read."""

    def attempt() -> Words:
        path = prompt.maybe_path(question)
        if path is None:
            return []
        load(path)
        return [option, str(path)]

    return prompt.until_right(attempt)


POSES = GuideStep(
    "The tracker's log",
    (
        "Export the object's pose in its own resting frame, seconds and metres, quaternions with w "
        "last; blanks or commas between the numbers.",
    ),
    _ask_poses,
    ("POSES",),
)
