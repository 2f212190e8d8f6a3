"""An actor at other moments than its own frames: between them, for a film with a clock of its own."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp

from render.actors import Actor

Vertices = Callable[[int], Float[np.ndarray, "verts 3"]]


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
