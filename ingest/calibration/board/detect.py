"""The board's corners in one picture."""

from typing import Any, NamedTuple

import cv2
import numpy as np
from jaxtyping import Float32, Float64, Int, UInt8
from scipy.spatial import KDTree

from ingest.calibration.board.spec import Board

Grey = UInt8[np.ndarray, "height width"]
_REACH = (2, 8)
"""Pixels around a corner that are looked at, at least and at most."""
_UNTIL = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-3)


class Corners(NamedTuple):
    """The corners of a board that one picture shows."""

    pixels: Float64[np.ndarray, "corners 2"]
    """(0, 0) is the centre of the first pixel."""
    numbers: Int[np.ndarray, " corners"]
    """As in `Board.corners`."""
    markers: int
    """How many markers of the board's dictionary are there."""


class Detector:
    """Finds one board in pictures."""

    def __init__(self, board: Board) -> None:
        self._detector = cv2.aruco.CharucoDetector(board.charuco)
        self._gap = (board.square - board.marker) / 2 / board.square

    def find(self, grey: Grey) -> Corners:
        """The corners seen, possibly none.

        Shapes differ between versions of OpenCV; they are the same here.
        """
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


def count_markers(grey: Grey, dictionary: int) -> int:
    """How many markers of a dictionary (OpenCV's number) a picture shows."""
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(dictionary))
    numbers: Any = detector.detectMarkers(grey)[1]
    return 0 if numbers is None else int(np.size(numbers))
