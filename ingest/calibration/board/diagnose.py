"""Why a board was not found: another dictionary, another layout, a mirrored print, or no board."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ingest.calibration.board.detect import Detector, Grey, count_markers
from ingest.calibration.board.homography import trusted
from ingest.calibration.board.lens import sightings
from ingest.calibration.board.spec import MIN_CORNERS, Board, Checkerboard, dictionaries
from omomo_core.errors import InputError

_MARKERS = 4
"""So many markers in a picture are no accident."""
_USUAL = "250"
"""Markers in a dictionary: boards need no more, and to look for more takes long."""
_CLEAR = 8
_MIRRORED = "mirrored"
_FITS = 0.8
"""Part of a picture's corners that one homography explains if the layout is right."""
_FOCAL = 1000.0


def not_found(pictures: Sequence[Grey], board: Board | Checkerboard, where: str) -> InputError:
    """The error that tells what the pictures show instead of the board.

    Args:
        pictures: a few that should show it; each takes a second or so.
        board: what was looked for.
        where: the pictures' file, for the message.
    """
    if isinstance(board, Checkerboard):
        return InputError(
            "board-not-seen",
            f"No picture shows the whole of the {board}.",
            where=where,
            fix="Keep all of its squares in view, with white around them, without glare; count its "
            "inner corners, columns first.",
        )
    own = max(count_markers(p, dictionaries()[board.dictionary]) for p in pictures)
    if own >= _MARKERS:
        return _wrong_layout(pictures, board, where)
    counts = _counts(pictures, board)
    most = max(counts, key=lambda name: counts[name])
    if most == _MIRRORED and counts[most] >= _MARKERS:
        return InputError(
            "board-mirrored",
            "The board is there as a mirror image.",
            where=where,
            fix="Film with the back camera, or switch off mirroring; or print the board again.",
        )
    if counts[most] >= _MARKERS:
        return InputError(
            "board-dictionary-other",
            f"The markers in the pictures are of {most}, not of {board.dictionary}.",
            where=where,
            fix=f"Give the text of the board that was printed; it ends with {most}.",
        )
    return InputError(
        "board-not-seen",
        f"No picture shows the board {board}.",
        where=where,
        fix="Bring it nearer to the camera, light it well, avoid glare and fast motion; a marker's "
        "cell must measure three pixels or more.",
    )


def _counts(pictures: Sequence[Grey], board: Board) -> Counter[str]:
    """Markers of other dictionaries, and of the board's own in the mirror.

    Some dictionaries read a few markers into those of others: the one with most is right.
    """
    counts: Counter[str] = Counter({_MIRRORED: 0})
    for picture in pictures:
        for name, number in other_families(board.dictionary).items():
            counts[name] += count_markers(picture, number)
        turned = np.ascontiguousarray(picture[:, ::-1])
        counts[_MIRRORED] += count_markers(turned, dictionaries()[board.dictionary])
        if max(counts.values()) >= _CLEAR:
            break
    return counts


def other_families(dictionary: str) -> dict[str, int]:
    """OpenCV's numbers of one dictionary of each kind but this one, by name.

    Small ones are the beginnings of larger ones.
    """
    kinds: dict[str, str] = {}
    for name in dictionaries():
        kind, _, size = name.rpartition("_")
        if not size.isdigit():
            kinds[name] = name
        elif size == _USUAL:
            kinds[kind] = name
    return {name: dictionaries()[name] for name in kinds.values() if name != dictionary}


def fits(pictures: Sequence[Grey], board: Board | Checkerboard) -> bool:
    """Whether the corners found lie as on the board in most of the pictures that show any."""
    good = shown = 0
    for picture in pictures:
        found = Detector(board).find(picture)
        shown += found.markers >= _MARKERS
        if len(found.numbers) < MIN_CORNERS:
            continue
        seen = np.zeros((1, len(board.corners)), bool)
        pixels = np.zeros((1, len(board.corners), 2))
        seen[0, found.numbers], pixels[0, found.numbers] = True, found.pixels
        K = np.diag([_FOCAL, _FOCAL, 1.0])
        sight = sightings(board.corners, seen, pixels, K, np.zeros(5))
        agree = trusted(sight, np.random.default_rng(0)).sum()
        good += int(agree >= max(MIN_CORNERS, _FITS * seen.sum()))
    return good > 0.5 * shown


def _wrong_layout(pictures: Sequence[Grey], board: Board, where: str) -> InputError:
    others = [
        replace(board, legacy=not board.legacy),
        replace(board, columns=board.rows, rows=board.columns),
        replace(board, columns=board.rows, rows=board.columns, legacy=not board.legacy),
    ]
    right = [other for other in others if fits(pictures, other)]
    advice = f"It looks like {right[0]}." if right else "Count its columns and rows of squares."
    return InputError(
        "board-layout",
        f"Markers of {board.dictionary} are there, but not laid out as on {board}.",
        where=where,
        fix=f"{advice} Columns come first, with marker 0 in the top row.",
    )
