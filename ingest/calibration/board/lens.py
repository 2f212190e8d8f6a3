"""Pixels into directions, and how an error of a direction shows in pixels."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64

_STEP = 1e-5
_NEWTON = 3


@dataclass(frozen=True)
class Sightings:
    """Points of a board seen in frames, one column for each of its points."""

    points: Float64[np.ndarray, "corners 3"]
    """In the board's frame, metres."""
    seen: Bool[np.ndarray, "frames corners"]
    direction: Float64[np.ndarray, "frames corners 2"]
    """x/z and y/z in the camera (OpenCV's axes), lens undone; 0 where not seen."""
    to_pixels: Float64[np.ndarray, "frames corners 2 2"]
    """Maps small changes of a direction to pixels."""

    def of(self, frames: np.ndarray) -> "Sightings":
        """These frames only (indices or mask)."""
        return Sightings(
            self.points, self.seen[frames], self.direction[frames], self.to_pixels[frames]
        )


def sightings(
    points: Float64[np.ndarray, "corners 3"],
    seen: Bool[np.ndarray, "frames corners"],
    pixels: Float64[np.ndarray, "frames corners 2"],
    K: Float64[np.ndarray, "*frames 3 3"],
    distortion: Float64[np.ndarray, " coefficients"],
) -> Sightings:
    """Undo the lens.

    Args:
        points: of the board, metres.
        seen: whether a frame shows a point.
        pixels: where (any value where not seen).
        K: of all frames, or of each; skew is left out.
        distortion: OpenCV's coefficients, of any of its number; none or zeros for no distortion.
    """
    focal = np.broadcast_to(np.diagonal(K, axis1=-2, axis2=-1)[..., :2], (len(seen), 2))
    centre = np.broadcast_to(K[..., :2, 2], (len(seen), 2))
    bent = np.where(seen[..., None], (pixels - centre[:, None]) / focal[:, None], 0.0)
    to_pixels = np.zeros((*seen.shape, 2, 2))
    to_pixels[...] = focal[:, None, :, None] * np.eye(2)
    if not distortion.any():
        return Sightings(points, seen, bent, to_pixels)
    direction = bent.copy()
    direction[seen], slope = undistorted(bent[seen], distortion)
    to_pixels[seen] = to_pixels[seen] @ slope
    return Sightings(points, seen, direction, to_pixels)


def undistorted(
    bent: Float64[np.ndarray, "n 2"], distortion: Float64[np.ndarray, " coefficients"]
) -> tuple[Float64[np.ndarray, "n 2"], Float64[np.ndarray, "n 2 2"]]:
    """Directions whose distorted ones are given, and the slope of the distortion there.

    OpenCV stops after five rounds, which leaves tenths of a pixel in strong lenses; Newton's steps
    finish its work.
    """
    if len(bent) == 0:
        return np.empty((0, 2)), np.empty((0, 2, 2))
    start = cv2.undistortPoints(bent.reshape(-1, 1, 2), np.eye(3), distortion)
    direction = np.asarray(start, float).reshape(-1, 2)
    slope = np.empty((len(bent), 2, 2))
    for _ in range(_NEWTON):
        for axis in range(2):
            step = _STEP * np.eye(2)[axis]
            rise = distorted(direction + step, distortion) - distorted(direction - step, distortion)
            slope[:, :, axis] = rise / (2 * _STEP)
        miss = bent - distorted(direction, distortion)
        direction = direction + np.linalg.solve(slope, miss[..., None])[..., 0]
    return direction, slope


def distorted(
    direction: Float64[np.ndarray, "n 2"], distortion: Float64[np.ndarray, " coefficients"]
) -> Float64[np.ndarray, "n 2"]:
    """Directions x/z, y/z after the lens's distortion (OpenCV's model)."""
    if len(direction) == 0:
        return direction
    rays = np.concatenate([direction, np.ones((len(direction), 1))], axis=1)
    zero = np.zeros(3)
    bent = cv2.projectPoints(rays, zero, zero, np.eye(3), distortion)[0]
    return np.asarray(bent, float).reshape(-1, 2)
