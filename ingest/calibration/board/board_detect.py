"""Corners of a board in a picture, and why none were found."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Int, UInt8
from scipy.spatial import KDTree

from ingest.calibration.board.board_lens import sightings, trusted
from ingest.calibration.board.board_spec import MIN_CORNERS, Board, Checkerboard, dictionaries
from omomo_core.errors import InputError

Grey = UInt8[np.ndarray, "height width"]
_REACH = (2, 8)
"""Pixels around a corner that are looked at, at least and at most."""
_GAP = 0.3
"""Part of a plain square around a corner that is looked at."""
_LEAST_CONTRAST = 0.25
"""Part of a board's usual contrast that each pair of its squares has at least."""
_UNTIL = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-3)


class Corners(NamedTuple):
    """The corners of a board that one picture shows."""

    pixels: Float64[np.ndarray, "corners 2"]
    """(0, 0) is the centre of the first pixel."""
    numbers: Int[np.ndarray, " corners"]
    """Numbers as in `Grid.corners`."""
    markers: int
    """How many markers of the board's dictionary are there."""


class Detector:
    """Finds one board in pictures."""

    def __init__(self, board: Board | Checkerboard) -> None:
        self._board = board
        if isinstance(board, Board):
            self._detector = cv2.aruco.CharucoDetector(board.charuco)
            self._gap = (board.square - board.marker) / 2 / board.square
        else:
            self._gap = _GAP

    def find(self, grey: Grey) -> Corners:
        """The corners seen, possibly none; of a plain checkerboard all or none.

        A checkerboard that looks the same when it is turned may be found either way round.
        """
        if isinstance(self._board, Checkerboard):
            return self._plain(grey, self._board)
        return self._marked(grey)

    def _plain(self, grey: Grey, board: Checkerboard) -> Corners:
        size = (board.columns - 1, board.rows - 1)
        found, pixels = cv2.findChessboardCornersSB(grey, size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
        if not found:
            return Corners(np.empty((0, 2)), np.empty(0, np.int64), 0)
        flat = np.asarray(pixels, np.float32).reshape(-1, 2)
        grid = self._refined(grey, flat).reshape(board.rows - 1, board.columns - 1, 2)
        turned = _turned(grey, grid)
        if turned is None:
            return Corners(np.empty((0, 2)), np.empty(0, np.int64), 0)
        return Corners(turned.reshape(-1, 2), np.arange(len(flat)), 0)

    def _marked(self, grey: Grey) -> Corners:
        """The corners of a ChArUco board; their shapes differ between versions of OpenCV."""
        found: Any = self._detector.detectBoard(grey)
        pixels, numbers, _, markers = found
        count = 0 if markers is None else np.size(markers)
        if numbers is None or np.size(numbers) == 0:
            return Corners(np.empty((0, 2)), np.empty(0, np.int64), count)
        where = self._refined(grey, np.asarray(pixels, np.float32).reshape(-1, 2))
        return Corners(where, np.asarray(numbers, np.int64).ravel(), count)

    def _refined(
        self, grey: Grey, pixels: Float32[np.ndarray, "corners 2"]
    ) -> Float64[np.ndarray, "corners 2"]:
        """Corners once more at their sub-pixel place, looking no farther than the nearest marker.

        OpenCV 4 places them half a pixel too far right and down; 5 looks too far in blurred pictures.
        """
        if len(pixels) < 2:
            return pixels.astype(np.float64)
        apart = KDTree(pixels).query(pixels, k=2)[0][:, 1]
        reach = int(np.clip(np.rint(self._gap * np.median(apart)), *_REACH))
        refined = cv2.cornerSubPix(
            grey, pixels.reshape(-1, 1, 2).copy(), (reach, reach), (-1, -1), _UNTIL
        )
        return np.asarray(refined, np.float64).reshape(-1, 2)


def _turned(
    grey: Grey, grid: Float64[np.ndarray, "rows columns 2"]
) -> Float64[np.ndarray, "rows columns 2"] | None:
    """The corners in the order of the board: never mirrored, and with a black square at the origin.

    None where the squares around them are no board: OpenCV sometimes takes the outer rim for corners.
    """
    across, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if across[0] * down[1] - across[1] * down[0] < 0:
        grid = grid[:, ::-1]
    turns = [turn for k in range(4) if (turn := np.rot90(grid, k)).shape == grid.shape]
    steps = [_steps(grey, turn) for turn in turns]
    best = int(np.argmax([step.mean() for step in steps]))
    # A board that looks the same when it is turned may have white at all ends.
    contrast = np.sign(steps[best].mean()) * steps[best]
    return turns[best] if contrast.min() > _LEAST_CONTRAST * np.median(contrast) else None


def _steps(
    grey: Grey, grid: Float64[np.ndarray, "rows columns 2"]
) -> Float64[np.ndarray, " steps"]:
    """How much lighter white squares are than black ones beside them, the outermost ones included."""
    wide = np.concatenate([2 * grid[:1] - grid[1:2], grid, 2 * grid[-1:] - grid[-2:-1]])
    wide = np.concatenate(
        [2 * wide[:, :1] - wide[:, 1:2], wide, 2 * wide[:, -1:] - wide[:, -2:-1]], 1
    )
    middle = (wide[:-1, :-1] + wide[1:, :-1] + wide[:-1, 1:] + wide[1:, 1:]) / 4
    x, y = np.rint(middle).astype(int).transpose(2, 0, 1)
    light = grey[y.clip(0, grey.shape[0] - 1), x.clip(0, grey.shape[1] - 1)].astype(float)
    black = np.add.outer(np.arange(light.shape[0]), np.arange(light.shape[1])) % 2 == 0
    sign = np.where(black, 1.0, -1.0)
    right = sign[:, :-1] * np.diff(light, axis=1)
    below = sign[:-1] * np.diff(light, axis=0)
    return np.concatenate([right.ravel(), below.ravel()])


def count_markers(grey: Grey, dictionary: int) -> int:
    """How many markers of a dictionary (OpenCV's number) a picture shows."""
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(dictionary))
    numbers: Any = detector.detectMarkers(grey)[1]
    return 0 if numbers is None else int(np.size(numbers))


_MARKERS = 4
"""So many markers in a picture are no accident."""
_USUAL = "250"
"""Markers in a dictionary: boards need no more, and to look for more takes long."""
_CLEAR_MATCHES = 8
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
        if max(counts.values()) >= _CLEAR_MATCHES:
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
