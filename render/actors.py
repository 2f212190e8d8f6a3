"""Actors: drawables with their motion, and the loop that plays them."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8

from render.cameras import Camera
from render.renderer import Renderer
from render.scene import Drawable


@dataclass(frozen=True)
class Actor:
    """A drawable and what changes of it from frame to frame; what is None stays as it is."""

    drawable: Drawable
    vertices: Callable[[int], Float[np.ndarray, "verts 3"]] | None = None
    """Vertices at a frame; of an array (frames, verts, 3) pass its `__getitem__`."""
    T_world: Float[np.ndarray, "frames 4 4"] | None = None
    """Pose of the drawable's frame in the world."""
    color: Float[np.ndarray, "frames 3"] | None = None
    visible: Bool[np.ndarray, " frames"] | None = None

    def pose(self, renderer: Renderer, frame: int) -> None:
        """Bring the drawable in `renderer` to `frame`."""
        renderer.update(
            self.drawable.name,
            vertices=None if self.vertices is None else self.vertices(frame),
            T_world=None if self.T_world is None else self.T_world[frame],
            color=None if self.color is None else self.color[frame],
            visible=None if self.visible is None else bool(self.visible[frame]),
        )


def play(
    renderer: Renderer,
    actors: Sequence[Actor],
    cameras: Sequence[Camera],
    only: Sequence[int] | None = None,
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """One picture per camera: frame i of every actor seen from `cameras[i]`.

    The renderer must be showing a scene that holds the actors' drawables. `only` names the frames to
    draw; without it, all are drawn.
    """
    for frame in range(len(cameras)) if only is None else only:
        for actor in actors:
            actor.pose(renderer, frame)
        yield renderer.color(cameras[frame])
