"""Whether a film shows the board: a look at its first half minute."""

from collections.abc import Iterator
from itertools import islice, takewhile
from pathlib import Path

from capture_app.calibration.guide.finding import Finding
from capture_app.calibration.guide.recording import pictured_recording
from ingest.calibration.board.board_detect import Corners, Detector, Grey, fits, not_found
from ingest.calibration.board.board_spec import MIN_CORNERS, Board
from ingest.calibration.board.board_track import TIMES, Picture, of_folder, of_session, of_video
from ingest.calibration.screen.views import photos
from ingest.calibration.still import CARRIED, clamped_stills
from ingest.formats.registry import read_session
from ingest.session import CaptureSession
from omomo_core.errors import InputError

_RATE, _SECONDS, _MOST = 2.0, 30.0, 60
"""Pictures a second that are looked at, for how long, and how many at most."""
_OFTEN, _BEFORE_CLAMPING = 0.5, 0.25
"""Part of the pictures that should show the board: of one that is filmed all the time, and of one that
is filmed for a while before the phone is clamped."""
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


def photographed_boards(folder: Path, boards: dict[str, Board]) -> Finding:
    """Boards in a folder of photos, each by what it is on; eight of the photos are looked at.

    Raises:
        InputError: of `photos`, or of `not_found` for a board that is in none of them.
    """
    every = max(1, sum(1 for _ in folder.glob("*")) // 8)
    looked = [photo.grey for photo in islice(photos(folder), 0, None, every)]
    counts: list[str] = []
    doubts: list[str] = []
    for name, board in boards.items():
        shown = sum(_enough(Detector(board).find(grey)) for grey in looked)
        if not shown:
            raise not_found(looked[:_SAMPLES], board, str(folder))
        counts.append(f"{name} in {shown}")
        if shown < _OFTEN * len(looked):
            doubts.append(
                f"{name[0].upper()}{name[1:]} is missed in most of them. Come nearer, look at it at "
                "a slant, with its brightness up and no reflections in it."
            )
    return Finding(f"of {len(looked)} photos looked at, {' and '.join(counts)}", tuple(doubts))


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
    for picture in islice(_beginning(pictures), _MOST):
        found = detector.find(picture.grey)
        if len(corners) % _SAMPLES == 0:
            some.append(picture.grey)
        if _enough(found) and len(showing) < _SAMPLES:
            showing.append(picture.grey)
        corners.append(len(found.numbers) if _enough(found) else 0)
    if not some:
        raise InputError("no-video", "There are no pictures.", where=where, fix="Film the board.")
    if not fits(showing, board):
        raise not_found(showing or some[:: -(-len(some) // _SAMPLES)], board, where)
    return _told(corners, board, some[0], often)


def _told(corners: list[int], board: Board, picture: Grey, often: float) -> Finding:
    """Of the corners found in each picture; none where there were too few of them."""
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
