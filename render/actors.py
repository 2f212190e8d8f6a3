"""Actors: drawables with their motion, the loop that plays them, and actors between their frames."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.spatial.transform import Rotation, Slerp

from render.cameras import Camera
from render.renderer import Renderer
from render.scene import Drawable

Vertices = Callable[[int], Float[np.ndarray, "verts 3"]]


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


def retimed(actor: Actor, at: Float[np.ndarray, " pictures"], count: int) -> Actor:
    """The actor whose k-th frame is what `actor` does at its frame `at[k]`, a whole number or not.

    Vertices and positions go straight and rotations evenly from frame to frame; colour and
    visibility are those of the nearest frame. Before the first of its `count` frames and after the
    last it rests.
    """
    at = np.clip(at, 0.0, count - 1.0)
    nearest = np.rint(at).astype(int)
    return replace(
        actor,
        vertices=None if actor.vertices is None else _between(actor.vertices, at),
        T_world=None if actor.T_world is None else poses_at(actor.T_world, at),
        color=None if actor.color is None else actor.color[nearest],
        visible=None if actor.visible is None else actor.visible[nearest],
    )


def poses_at(
    T: Float[np.ndarray, "frames 4 4"], at: Float[np.ndarray, " pictures"]
) -> Float[np.ndarray, "pictures 4 4"]:
    """Poses between frames: moved straight and turned evenly from one to the next."""
    if len(T) == 1:
        return np.tile(T, (len(at), 1, 1))
    known = np.arange(len(T))
    out = np.tile(np.eye(4), (len(at), 1, 1))
    out[:, :3, :3] = Slerp(known, Rotation.from_matrix(T[:, :3, :3]))(at).as_matrix()
    for axis in range(3):
        out[:, axis, 3] = np.interp(at, known, T[:, axis, 3])
    return out


def _between(vertices: Vertices, at: Float[np.ndarray, " pictures"]) -> Vertices:
    def moved(picture: int) -> Float[np.ndarray, "verts 3"]:
        before = int(np.floor(at[picture]))
        share = at[picture] - before
        start = vertices(before)
        return start if share == 0 else (1 - share) * start + share * vertices(before + 1)

    return moved
