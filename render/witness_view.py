"""What a camera on a tripod sees of things that move in a room, through its own lens."""

from collections.abc import Callable, Iterator, Sequence

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from render.actors import Actor, play
from render.cameras import Camera
from render.renderer import Backend, open_renderer
from render.room import ROOM_LIGHT, room
from render.scene import Scene

_GAP = 2.0
"""Walls stand this far from the camera and from the things, metres."""
_CEILING = 2.7
_FINER = 1.5
"""Pixels drawn for one of a bent picture, along each axis."""

_ROUNDS, _DONE = 30, 1e-5
"""Of going back; a hundredth of a pixel is nothing."""

Distort = Callable[[Float[np.ndarray, "n 2"]], Float[np.ndarray, "n 2"]]
"""Maps directions x/z, y/z (x right, y down) to where the lens shows them."""


def frames(
    T_world_camera: Float[np.ndarray, "4 4"],
    actors: Sequence[Actor],
    count: int,
    *,
    K: Float[np.ndarray, "3 3"],
    width: int,
    height: int,
    distort: Distort | None = None,
    seed: int = 0,
    backend: Backend = "auto",
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """One picture for each frame of the actors, of a room with detail all over and of them.

    Args:
        T_world_camera: of the tripod; OpenCV's axes, world z up, floor at 0, metres.
        actors: what moves, posed by `T_world`.
        count: how many frames.
        K: camera matrix, pixels; (0, 0) is the centre of the first.
        width, height: pixels.
        distort: the lens; None bends nothing.
        seed: paints the room.
        backend: see `open_renderer`.
    """
    places = [
        T_world_camera[None, :3, 3],
        *(a.T_world[:, :3, 3] for a in actors if a.T_world is not None),
    ]
    at = np.concatenate(places)
    low, high = at.min(axis=0) - _GAP, at.max(axis=0) + _GAP
    low[2], high[2] = 0.0, max(_CEILING, float(at[:, 2].max()) + 0.5)
    lens = _Lens(K, width, height, distort)
    fx, fy, cx, cy = lens.pinhole
    camera = Camera(T_world_camera @ np.diag([1.0, -1.0, -1.0, 1.0]), fx, fy, cx, cy)
    with open_renderer(lens.width, lens.height, backend) as renderer:
        drawables = [a.drawable for a in actors]
        renderer.show(Scene([*room(low, high, seed), *drawables], light=ROOM_LIGHT))
        for rgb, _ in play(renderer, actors, [camera] * count):
            yield lens.bend(rgb)


class _Lens:
    """A larger picture without distortion, from which the bent one is sampled."""

    def __init__(
        self, K: Float[np.ndarray, "3 3"], width: int, height: int, distort: Distort | None
    ) -> None:
        self._map: tuple[np.ndarray, np.ndarray] | None = None
        self.width, self.height = width, height
        self.pinhole = (K[0, 0], K[1, 1], K[0, 2], K[1, 2])
        if distort is None:
            return
        u, v = np.meshgrid(np.arange(width), np.arange(height))
        bent = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]], axis=-1).reshape(-1, 2)
        rays = _straightened(bent, distort)
        low, high = rays.min(axis=0) - 0.01, rays.max(axis=0) + 0.01
        focal = _FINER * np.array([K[0, 0], K[1, 1]])
        self.width, self.height = np.ceil((high - low) * focal).astype(int).tolist()
        self.pinhole = (*focal, *(-low * focal))
        where = ((rays - low) * focal).astype(np.float32).reshape(height, width, 2)
        self._map = where[..., 0], where[..., 1]

    def bend(self, rgb: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "height width 3"]:
        """The picture through the lens."""
        if self._map is None:
            return rgb
        return np.asarray(cv2.remap(rgb, *self._map, cv2.INTER_LINEAR), np.uint8)


def _straightened(bent: Float[np.ndarray, "n 2"], distort: Distort) -> Float[np.ndarray, "n 2"]:
    """Directions that the lens bends to these, by going back what it moves them."""
    rays = bent.copy()
    for _ in range(_ROUNDS):
        back = bent - distort(rays)
        rays += back
        if np.abs(back).max() < _DONE:
            break
    return rays
