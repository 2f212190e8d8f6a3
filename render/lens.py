"""Lens distortion: pictures are drawn larger and straight, and bent afterwards."""

from collections.abc import Callable

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from render.cameras import Camera

_ROUNDS, _DONE = 30, 1e-5
"""Of going back; a hundredth of a pixel is nothing."""

Distort = Callable[[Float[np.ndarray, "n 2"]], Float[np.ndarray, "n 2"]]
"""Maps directions x/z, y/z (x right, y down) to where the lens shows them."""


class LensDistortion:
    """A larger picture without distortion, from which the bent one is sampled."""

    def __init__(
        self,
        K: Float[np.ndarray, "3 3"],
        width: int,
        height: int,
        distort: Distort | None,
        *,
        finer: float = 1.5,
    ) -> None:
        """A lens for pictures of one camera.

        Args:
            K: camera matrix, pixels; (0, 0) is the centre of the first.
            width, height: of the bent pictures, pixels.
            distort: the lens; None bends nothing.
            finer: pixels drawn for one of a bent picture, along each axis.
        """
        self._map: tuple[np.ndarray, np.ndarray] | None = None
        self.width, self.height = width, height
        self._pinhole = (K[0, 0], K[1, 1], K[0, 2], K[1, 2])
        if distort is None:
            return
        u, v = np.meshgrid(np.arange(width), np.arange(height))
        bent = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]], axis=-1).reshape(-1, 2)
        rays = _straightened(bent, distort)
        low, high = rays.min(axis=0) - 0.01, rays.max(axis=0) + 0.01
        focal = finer * np.array([K[0, 0], K[1, 1]])
        self.width, self.height = np.ceil((high - low) * focal).astype(int).tolist()
        self._pinhole = (*focal, *(-low * focal))
        where = ((rays - low) * focal).astype(np.float32).reshape(height, width, 2)
        self._map = where[..., 0], where[..., 1]

    def camera(self, T_world_camera: Float[np.ndarray, "4 4"]) -> Camera:
        """What draws the straight picture, `self.width` x `self.height`; `Camera`'s axes."""
        return Camera(T_world_camera, *self._pinhole)

    def bend(self, picture: UInt8[np.ndarray, "h w c"]) -> UInt8[np.ndarray, "height width c"]:
        """The straight picture as the lens shows it."""
        if self._map is None:
            return picture
        return np.asarray(cv2.remap(picture, *self._map, cv2.INTER_LINEAR), np.uint8)


def _straightened(bent: Float[np.ndarray, "n 2"], distort: Distort) -> Float[np.ndarray, "n 2"]:
    """Directions that the lens bends to these, by going back what it moves them."""
    rays = bent.copy()
    for _ in range(_ROUNDS):
        back = bent - distort(rays)
        rays += back
        if np.abs(back).max() < _DONE:
            break
    return rays
