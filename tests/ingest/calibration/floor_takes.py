"""Simulated takes of things that stand on the floor, are pushed over it, and lifted to another place."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from capture_app.simulator.simulated_phone import PhoneNoise, simulate
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.uncertainty import moved
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion
from tests.simulator.gravity_error import unlevel

REST, PUSH, LIFT = 1.2, 1.5, 1.5
"""Seconds of each part of a take."""

SIDES = [
    Rotation.identity(),
    Rotation.from_euler("x", 90, degrees=True),
    Rotation.from_euler("y", -90, degrees=True),
]
"""Of an object, turned down onto the floor."""


@dataclass(frozen=True)
class Stand:
    """Where the object stands, on which side, and how it gets to the next place."""

    place: tuple[float, float]
    yaw: float
    side: Rotation = field(default_factory=Rotation.identity)
    """Of the object in the world, before the yaw."""
    push: bool = False
    """Pushed to the next place; lifted otherwise."""


def crate(x: float = 0.4, y: float = 0.3, z: float = 0.5) -> ObjectMesh:
    """A box with its frame at the middle of its bottom."""
    corners = np.array(
        [[a, b, c] for a in (-x / 2, x / 2) for b in (-y / 2, y / 2) for c in (0, z)]
    )
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
                      [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # fmt: skip
    return ObjectMesh(corners, faces, "crate")


def standing_motion(mesh: ObjectMesh, stands: list[Stand]) -> ObjectMotion:
    """At rest in each place; pushed at one height, or lifted by 0.6 m, in between."""
    poses = [_pose(mesh, stand) for stand in stands]
    T = [np.tile(poses[0], (round(REST * FPS), 1, 1))]
    for stand, before, after in zip(stands, poses, poses[1:], strict=False):
        count = round((PUSH if stand.push else LIFT) * FPS)
        x = np.arange(1, count + 1) / count
        part = x**3 * (10 - 15 * x + 6 * x**2)
        way = np.tile(np.eye(4), (count, 1, 1))
        turning = Slerp([0, 1], Rotation.from_matrix(np.stack([before, after])[:, :3, :3]))
        way[:, :3, :3] = turning(part).as_matrix()
        way[:, :3, 3] = before[:3, 3] + part[:, None] * (after[:3, 3] - before[:3, 3])
        way[:, 2, 3] += (not stand.push) * 0.6 * np.sin(np.pi * part) ** 2
        T += [way, np.tile(after, (round(REST * FPS), 1, 1))]
    whole = np.concatenate(T)
    return ObjectMotion(mesh, whole, np.ones(len(whole), bool))


def _pose(mesh: ObjectMesh, stand: Stand) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = (Rotation.from_euler("z", stand.yaw) * stand.side).as_matrix()
    lowest = (mesh.vertices @ T[:3, :3].T)[:, 2].min()
    T[:3, 3] = [*stand.place, -lowest]
    return T


def clamped(rng: np.random.Generator) -> Mount:
    """A phone turned anyhow, above the feet and within arm's reach of the object's middle."""
    T_object_phone = np.eye(4)
    T_object_phone[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T_object_phone[:3, 3] = rng.uniform([-0.3, -0.3, 0.1], [0.3, 0.3, 0.6])
    return Mount(inverse(T_object_phone), "made up")


def believed(truth: Mount, covariance: np.ndarray, rng: np.random.Generator) -> Mount:
    """What a calibration with these errors finds."""
    step = rng.multivariate_normal(np.zeros(6), covariance)
    T = moved(truth.T_phone_object, step)
    return replace(truth, T_phone_object=T, covariance=covariance)


def phone_height(motion: ObjectMotion, truth: Mount) -> float:
    """Metres of the lens over the floor at the start."""
    return float((motion.T_world_object[0] @ np.linalg.inv(truth.T_phone_object))[2, 3])


def recorded(
    motion: ObjectMotion, truth: Mount, seed: int, noise: PhoneNoise | None = None
) -> CaptureSession:
    """The session of a phone whose gravity errs as ARKit's does."""
    return unlevel(simulate(motion, truth, seed=seed, noise=noise), seed=seed)
