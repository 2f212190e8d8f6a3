"""VisualHull: what silhouettes say about every place around an object, for and against it.

A place that some pictures show beside the silhouette is empty, with the distance to the outline as a
signed distance (Laurentini 1994; the second or third largest over the pictures, as single masks err).
A place that pictures show inside the silhouette where no depth is known is backed by them: thin and
dark parts have no depth. Right beside depth that is known, a lack of it says nothing. Beside a bar a
quarter of the pictures decides: masks miss it where what lies behind it has its colour.
"""

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8
from scipy.ndimage import binary_dilation

from ingest.scan.dense.depth_map import DepthMap
from ingest.scan.dense.thin import BAR, thin_parts
from ingest.scan.dense.volume import Box

_INWARD = 0.4
"""Pixels by which outlines are moved outwards, because of many pictures the one that cuts most counts."""
_FAR = 12.0
"""Pixels from the outline beyond which distances are not told apart."""
_OUTVOTED = 20, 8
"""With so many pictures, the two or the one that put a place farthest outside are ignored as errors."""
_BACKED, _BACKED_SHARE = 4, 0.25
"""Pictures that must back a place, and their share among those that back it or see something before it."""
_EDGE = 5
"""Pixels from known depth within which missing depth says nothing (two pixels of a phone's depth map)."""
_BEFORE = 0.02
"""Metres by which depth must lie before a place to hide it."""
_DENIED = 0.25
"""Share of the pictures that must show the background at a place beside a bar before it counts as empty.
Asking for a half would leave a round bar 1.4 times as thick as it is: from half of the sides, such a place
lies before the bar or behind it."""
_VOTE = 2.0
"""Voxels by which a place counts as outside of the silhouettes where twice that share of the pictures
show the background."""
_UNKNOWN = np.float32(-1.0)
"""Metres outside, of places that a picture does not show: they count as inside."""


class VisualHull:
    """Sums over silhouettes, one slice above the other."""

    def __init__(self, box: Box, pictures: int) -> None:
        """Nothing is said yet.

        Args:
            box: where it is.
            pictures: that will be added.
        """
        self.box = box
        self._ignored = sum(pictures >= least for least in _OUTVOTED)
        levels = self._ignored + 1
        self._outside = np.full((levels, *box.shape), _UNKNOWN, np.float32)
        self._backing = np.zeros(box.shape, np.uint8)
        self._against = np.zeros(box.shape, np.uint8)
        self._hidden = np.zeros(box.shape, np.uint8)
        self._decided: Float32[np.ndarray, "z y x"] | None = None

    def add(
        self,
        mask: UInt8[np.ndarray, "h w"],
        depth: DepthMap,
        matrix: Float64[np.ndarray, "3 3"],
        T_camera_floor: Float64[np.ndarray, "4 4"],
        doubt: float = 0.0,
    ) -> None:
        """Add one more silhouette.

        Args:
            mask: 0 where the picture shows the background, 1 the object, more where it tells nothing.
            depth: of the same size; 0 where the object's is unknown.
            matrix, T_camera_floor: of the picture.
            doubt: metres by which what it says to be empty begins farther out.
        """
        outline = outline_distance(mask)
        shows = (mask == 1).astype(np.uint8)
        bare = _without_depth(shows, depth)
        P = matrix @ T_camera_floor[:3]
        step = (P[:, :3] * self.box.voxel).astype(np.float32)
        start = (P[:, :3] @ self.box.low + P[:, 3]).astype(np.float32)
        _, rows, columns = self.box.shape
        x, y = np.arange(columns, dtype=np.float32), np.arange(rows, dtype=np.float32)[:, None]
        level = [step[k, 0] * x + step[k, 1] * y + start[k] for k in range(3)]
        for index in range(self.box.shape[0]):
            u, v, z = (level[k] + step[k, 2] * np.float32(index) for k in range(3))
            ahead = np.maximum(z, np.float32(1e-3))
            u, v = u / ahead, v / ahead
            beside = cv2.remap(outline, u, v, cv2.INTER_LINEAR, borderValue=-1e6)
            known = (z > 0) & (beside > -1e3)
            metres = np.where(
                known, beside * z / np.float32(matrix[0, 0]) - np.float32(doubt), _UNKNOWN
            )
            self._rank(index, metres)
            self._against[index] += known & (metres > 0)
            shown = cv2.remap(depth, u, v, cv2.INTER_NEAREST, borderValue=0)
            inside = known & (cv2.remap(shows, u, v, cv2.INTER_NEAREST, borderValue=0) > 0)
            self._backing[index] += inside & (
                cv2.remap(bare, u, v, cv2.INTER_NEAREST, borderValue=0) > 0
            )
            self._hidden[index] += inside & (shown > 0) & (shown < z - _BEFORE)

    def _rank(self, index: int, metres: Float32[np.ndarray, "y x"]) -> None:
        """Keep the largest distances of each place, in falling order."""
        for largest in self._outside[:, index]:
            smaller = np.minimum(largest, metres)
            np.maximum(largest, metres, out=largest)
            metres = smaller

    def outside(self) -> Float32[np.ndarray, "z y x"]:
        """Metres by which a place lies outside of the silhouettes, below 0 inside."""
        if self._decided is None:
            voxel = self.box.voxel
            backing, against = self.backing(), self._against.astype(np.float32)
            share = against / np.maximum(against + backing, np.float32(1))
            vote = np.float32(_VOTE * voxel) * (share / np.float32(_DENIED) - 1).clip(-1, 1)
            vote = np.where(backing >= _BACKED, vote, np.inf)
            strict = self._outside[self._ignored]
            thin = thin_parts(np.minimum(strict, vote) < 0, voxel, BAR)
            # Beside a thick thing most pictures show it before or behind a place.
            thick = (strict < 0) & ~thin_parts(strict < 0, voxel, BAR)
            bars = _around(thin) & ~_around(thick)
            self._decided = np.where(bars, np.minimum(strict, vote), strict)
        return self._decided

    def backing(self) -> Float32[np.ndarray, "z y x"]:
        """Pictures that show the object at a place without knowing its depth."""
        return self._backing.astype(np.float32)

    def hidden(self) -> Float32[np.ndarray, "z y x"]:
        """Pictures that see something before a place."""
        return self._hidden.astype(np.float32)

    def backed(self, against: Float32[np.ndarray, "z y x"]) -> Bool[np.ndarray, "z y x"]:
        """Places where pictures show the object without knowing its depth.

        Args:
            against: as many of them must back a place, e.g. for those that see through it.
        """
        backing, hidden = self.backing(), self.hidden()
        enough = (backing >= _BACKED) & (backing >= _BACKED_SHARE * (backing + hidden))
        return enough & (backing >= against) & (self.outside() < 0)


def _around(places: Bool[np.ndarray, "z y x"]) -> Bool[np.ndarray, "z y x"]:
    return np.asarray(binary_dilation(places, iterations=2), np.bool_)


def _without_depth(shows: UInt8[np.ndarray, "h w"], depth: DepthMap) -> UInt8[np.ndarray, "h w"]:
    """1 where a silhouette holds something that has no depth, and is not the rim of what has some.

    Depth is dropped at edges, and outlines lie some pixels too far outside: neither shows a thin part.
    """
    measured = ((shows > 0) & (depth > 0)).astype(np.uint8)
    around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * _EDGE + 1, 2 * _EDGE + 1))
    return np.where(cv2.dilate(measured, around) > 0, np.uint8(0), shows)


def outline_distance(mask: UInt8[np.ndarray, "h w"]) -> Float32[np.ndarray, "h w"]:
    """Pixels from the outline of a mask, positive outside of it."""
    shown = (mask > 0).astype(np.uint8)
    away = cv2.distanceTransform(1 - shown, cv2.DIST_L2, 5)
    into = cv2.distanceTransform(shown, cv2.DIST_L2, 5)
    # Pixel centres on both sides of the outline lie half a pixel from it.
    distance = np.where(mask > 0, 0.5 - into, away - 0.5) - _INWARD
    return distance.clip(-_FAR, _FAR).astype(np.float32)
