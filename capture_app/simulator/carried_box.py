"""The demonstration take: a box lifted off the floor, carried along a bend and put down again."""

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from ingest.mount import Mount
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion

WIDTH, DEPTH, HEIGHT = 0.34, 0.44, 0.30
"""Extents of the box along its x (the way it is carried), y (from hand to hand) and z, metres."""
CARRYING_HEIGHT = 1.02
"""Of the box's centre, metres."""
PACE = 0.85
"""Walking speed in the middle of the carry, m/s."""
GAIT_HZ, BOB, SWAY = 1.7, 0.012, 0.010
"""Steps per second, and how far a carried box bobs and sways with them, metres."""
REST, LIFT, CARRY = 1.6, 1.5, 5.4
"""Seconds at rest (before and after), of lifting (and lowering), and of carrying."""


def carried_box() -> ObjectMotion:
    """The box's motion: 13 s at 30 fps, resting on the floor at both ends."""
    times = np.arange(int((2 * REST + 2 * LIFT + CARRY) * FPS)) / FPS
    lifted = _smooth((times - REST) / LIFT) - _smooth((times - REST - LIFT - CARRY) / LIFT)
    walked = np.clip((times - REST - LIFT) / CARRY, 0, 1)
    going = np.sin(np.pi * walked) ** 0.7 * (walked > 0) * (walked < 1)
    heading = np.radians(70) * _smooth(walked)
    step = PACE * going[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1) / FPS
    phase = 2 * np.pi * GAIT_HZ * times
    left = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    pose = np.tile(np.eye(4), (len(times), 1, 1))
    pose[:, :2, 3] = np.cumsum(step, axis=0) + (SWAY * going * np.sin(phase / 2))[:, None] * left
    # Lifting brings a load towards the body.
    pose[:, 0, 3] -= 0.10 * _smooth((times - REST) / LIFT)
    pose[:, 2, 3] = (
        HEIGHT / 2 + lifted * (CARRYING_HEIGHT - HEIGHT / 2) + BOB * going * np.sin(phase)
    )
    tilt = 0.12 * np.sin(np.pi * np.clip((times - REST) / LIFT, 0, 1))
    pose[:, :3, :3] = (
        Rotation.from_euler("z", heading[:, None]) * Rotation.from_euler("y", -tilt[:, None])
    ).as_matrix()
    return ObjectMotion(mesh=box_mesh(), T_world_object=pose, valid=np.ones(len(times), bool))


def box_mesh() -> ObjectMesh:
    """The box, its origin in the middle."""
    solid = trimesh.creation.box((WIDTH, DEPTH, HEIGHT)).subdivide().subdivide()
    return ObjectMesh(np.asarray(solid.vertices), np.asarray(solid.faces), "box")


def clamped_phone() -> Mount:
    """A phone on the far side of the box, portrait, looking ahead and a little down, not quite true."""
    R_object_phone: Float[np.ndarray, "3 3"] = np.array(
        [[0.0, 0.0, -1.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]]
    )
    crooked = Rotation.from_euler("xyz", [4.0, -9.0, 6.0], degrees=True).as_matrix()
    T_object_phone = np.eye(4)
    T_object_phone[:3, :3] = R_object_phone @ crooked
    T_object_phone[:3, 3] = [WIDTH / 2 + 0.03, 0.05, 0.06]
    return Mount(T_phone_object=np.linalg.inv(T_object_phone), method="drawing")


def _smooth(x: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    """Minimum-jerk step from 0 at x <= 0 to 1 at x >= 1."""
    x = np.clip(x, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x**2)
