"""The types that travel between the rooms. World: right-handed, z up, floor z = 0, metres, seconds."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

FPS = 30.0
"""Frame rate of everything inside the core."""


@dataclass(frozen=True)
class Texture:
    """The picture on a surface."""

    uv: Float[np.ndarray, "faces 3 2"]
    """Place of each corner of each triangle on the picture: (0, 0) is its top left corner, (1, 1)
    its bottom right one. Beyond them the picture repeats."""
    image: UInt8[np.ndarray, "h w 3"]
    """Red, green, blue; sRGB."""


@dataclass(frozen=True)
class ObjectMesh:
    """A rigid object's surface, in its own frame, in metres."""

    vertices: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    name: str
    texture: Texture | None = None
    """Texture for pictures alone; no motion depends on it."""
    notes: tuple[str, ...] = ()
    """What was done to read its file, or left out, in words for the user."""


@dataclass(frozen=True)
class ObjectMotion:
    """An object moving over the floor at 30 fps."""

    mesh: ObjectMesh
    T_world_object: Float[np.ndarray, "frames 4 4"]
    """Maps the mesh's vertices into the world."""
    valid: Bool[np.ndarray, " frames"]
    """False where the tracker was lost and the pose is a guess."""
    start_time: float = 0.0
    """Seconds from the start of the recording to frame 0."""


@dataclass(frozen=True)
class HandMotion:
    """The palms' positions, and whether they touch the object; index 0 is left, 1 right."""

    palms: Float[np.ndarray, "frames 2 3"]
    """Base of the middle fingers, world, metres."""
    contact: Float[np.ndarray, "frames 2"]
    """Probability of touching the object."""


@dataclass(frozen=True)
class HumanMotion:
    """One person's motion at 30 fps on the skeleton of `omomo_core.skeleton`."""

    root: Float[np.ndarray, "frames 3"]
    """Pelvis joint, world, metres."""
    rotations: Float[np.ndarray, "frames 22 3 3"]
    """Global R_world_joint of the body joints; the identity is the T-pose (y up, facing +z)."""
    fingers: Float[np.ndarray, "frames 30 3 3"]
    """Rotation of each finger joint relative to its parent."""
    joints: Float[np.ndarray, "frames 24 3"]
    """The 22 body joints and the two palms by forward kinematics, world, metres."""
    hand_contact: Float[np.ndarray, "frames 2"]
    """Left, right hand on the object: 1 held, 0 free."""
    foot_contact: Float[np.ndarray, "frames 4"]
    """Left ankle, right ankle, left toe, right toe planted on the floor."""
