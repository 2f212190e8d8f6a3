"""A box of 40 cm, the ways it moves, and hands predicted at places of it."""

from dataclasses import replace

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from omomo_core.geometry.surface import sample_surface
from omomo_core.motion import HandMotion, ObjectMesh

FRAMES = 90
BOX = trimesh.creation.box((0.4, 0.4, 0.4)).subdivide().subdivide().subdivide()
MESH = ObjectMesh(np.array(BOX.vertices), np.array(BOX.faces), "box")
SURFACE = sample_surface(MESH)
NOTHING = replace(SURFACE, points=SURFACE.points + 9.0)
"""The same box, where no palm comes."""
LEFT, RIGHT = np.array([-0.24, 0.05, 0.0]), np.array([0.24, -0.05, 0.0])
"""Where the palms hold it, in its frame."""


def carried(seed: int, frames: int = FRAMES) -> np.ndarray:
    """T_world_object of a box that carries on along a smooth random path and turns."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, frames)[:, None]
    T = np.tile(np.eye(4), (frames, 1, 1))
    T[:, :3, 3] = [0, 0, 1.0] + t * rng.normal(size=3) + 0.1 * np.sin(3 * t)
    T[:, :3, :3] = Rotation.from_rotvec(t * rng.normal(size=3)).as_matrix()
    return T


def hands(T: np.ndarray, contact: np.ndarray, *places: np.ndarray) -> HandMotion:
    """Palms at places of the box, (3,) or (frames, 3), left then right."""
    local = np.stack([np.broadcast_to(p, (len(T), 3)) for p in places or (LEFT, RIGHT)], axis=1)
    palms = np.einsum("fij,fhj->fhi", T[:, :3, :3], local) + T[:, None, :3, 3]
    return HandMotion(palms, contact.astype(float))


def switched(frames: int, *holds: tuple[int, int, int]) -> np.ndarray:
    """Contact 1 of a hand from start to stop, else 0."""
    contact = np.zeros((frames, 2))
    for hand, start, stop in holds:
        contact[start:stop, hand] = 1.0
    return contact
