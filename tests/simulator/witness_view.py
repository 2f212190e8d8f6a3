"""What a camera on a tripod sees of things that move in a room, through its own lens."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float, UInt8

from render.backends import Backend, open_renderer
from render.overlay import Distort, LensDistortion
from render.phone_view import ROOM_LIGHT, room
from render.props import Actor, play
from render.scene import Scene

_GAP = 2.0
"""Walls stand this far from the camera and from the things, metres."""
_CEILING = 2.7


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
    lens = LensDistortion(K, width, height, distort)
    camera = lens.camera(T_world_camera @ np.diag([1.0, -1.0, -1.0, 1.0]))
    with open_renderer(lens.width, lens.height, backend) as renderer:
        drawables = [a.drawable for a in actors]
        renderer.show(Scene([*room(low, high, seed), *drawables], light=ROOM_LIGHT))
        for rgb in play(renderer, actors, [camera] * count):
            yield lens.bend(rgb)
