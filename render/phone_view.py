"""What the phone's camera sees on its way through a room: the video of a simulated recording."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float, UInt8

from render.actors import Actor, play
from render.backends import Backend, open_renderer
from render.cameras import Camera
from render.room import ROOM_LIGHT, room
from render.scene import Scene

_WALL_GAP = 2.5
"""Walls stand this far from the nearest place of the phone, metres."""
_CEILING = 2.7


def frames(
    T_world_phone: Float[np.ndarray, "frames 4 4"],
    *,
    fx: float,
    fy: float,
    cx: float,
    cy: float,
    width: int,
    height: int,
    seed: int = 0,
    actors: Sequence[Actor] = (),
    backend: Backend = "auto",
    samples: int = 4,
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """One picture per pose, of a room with detail all over and of `actors` in it.

    Args:
        T_world_phone: poses of the phone's camera in a world with z up and the floor at 0, metres;
            camera axes as ARKit's (x right, y up, z toward the viewer).
        fx, fy, cx, cy: intrinsics in pixels of these pictures; (0, 0) is the centre of the first.
        width, height: pixels.
        seed: paints the room.
        actors: what else is there, such as the person (`third_person.skinned_body`), posed at the
            frames of `T_world_phone`.
        backend, samples: see `open_renderer`.
    """
    places = T_world_phone[:, :3, 3]
    low, high = places.min(axis=0) - _WALL_GAP, places.max(axis=0) + _WALL_GAP
    low[2], high[2] = 0.0, max(_CEILING, places[:, 2].max() + 0.5)
    walls = room(low, high, seed)
    cameras = [Camera(T, fx, fy, cx, cy) for T in T_world_phone]
    with open_renderer(width, height, backend, samples=samples) as renderer:
        renderer.show(Scene([*walls, *(a.drawable for a in actors)], light=ROOM_LIGHT))
        yield from play(renderer, actors, cameras)
