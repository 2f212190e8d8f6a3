"""What the phone's camera sees on its way through a room full of detail."""

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from render.backends import Backend, open_renderer
from render.cameras import Camera
from render.props import Actor, play
from render.scene import Drawable, Light, Scene

ROOM_LIGHT = Light(elevation=1.3, sky=0.80, ground=0.70)
"""More a lamp on the ceiling than a sun."""

_SIDE = 2048
"""Texels along each side of a wall."""
_SHAPES = 260


def room(low: Float[np.ndarray, " 3"], high: Float[np.ndarray, " 3"], seed: int) -> list[Drawable]:
    """Floor, ceiling and four walls of the box between two corners (world, metres).

    Every side is painted at random, in no pattern that repeats; the same seed paints the same room.
    """
    rng = np.random.default_rng(seed)
    return [
        _wall(low, high, axis, side, busy_texture(rng)) for axis in range(3) for side in range(2)
    ]


def busy_texture(rng: np.random.Generator, side: int = _SIDE) -> UInt8[np.ndarray, "h w 3"]:
    """Noise of all sizes with shapes strewn over it: corners everywhere, at any distance."""
    base = rng.uniform(110.0, 190.0, 3)
    image = np.tile(base, (side, side, 1)).astype(np.float32)
    for cells in (6, 40, 256):
        noise = rng.normal(0.0, 9.0, (cells, cells, 3)).astype(np.float32)
        image += cv2.resize(noise, (side, side), interpolation=cv2.INTER_CUBIC)
    for size in np.geomspace(0.12, 0.006, _SHAPES) * side:
        _strew(image, rng, size)
    return np.clip(image, 0.0, 255.0).astype(np.uint8)


def _strew(image: np.ndarray, rng: np.random.Generator, size: float) -> None:
    """One triangle, box or disc of about `size` texels somewhere on the image."""
    at = rng.uniform(0.0, len(image), 2)
    color = rng.uniform(30.0, 235.0, 3).tolist()
    corners = rng.integers(3, 9)
    angle = rng.uniform(0.0, 6.28) + np.arange(corners) * 2.0 * np.pi / corners
    ring = at + size * np.stack([np.cos(angle), rng.uniform(0.3, 1.0) * np.sin(angle)], axis=1)
    cv2.fillPoly(image, [ring.astype(np.int32)], color, cv2.LINE_AA)


def _wall(
    low: Float[np.ndarray, " 3"],
    high: Float[np.ndarray, " 3"],
    axis: int,
    side: int,
    texture: UInt8[np.ndarray, "h w 3"],
) -> Drawable:
    """The side of the box where coordinate `axis` is lowest (side 0) or highest (side 1)."""
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    corners = np.empty((4, 3))
    corners[:, axis] = (low, high)[side][axis]
    for k, across in enumerate(((axis + 1) % 3, (axis + 2) % 3)):
        corners[:, across] = low[across] + square[:, k] * (high[across] - low[across])
    inward = [[0, 1, 2], [0, 2, 3]] if side == 0 else [[0, 2, 1], [0, 3, 2]]
    return Drawable(
        f"room {'xyz'[axis]} {('low', 'high')[side]}",
        corners,
        np.array(inward),
        uv=square,
        texture=texture,
        casts_shadow=False,
    )


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
