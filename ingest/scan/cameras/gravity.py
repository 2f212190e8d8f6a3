"""upright: where up is, by how the cameras were held and by the floor below what they saw."""

from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float64

from ingest.scan.cameras.metric import Similarity
from omomo_core.geometry.transforms import shortest_turn

_Z = np.array([0.0, 0.0, 1.0])
_TILT = np.cos(np.radians(20.0))
"""Between the floor's normal and where the cameras say that up is."""
_DRAWS = 600
_THICK = 0.006
"""Half the floor's thickness, in distances of the cameras from what they look at."""
_SHARE = 0.06
"""Part of the sparse points that lie on the floor at least."""
_BELOW = 0.05
"""Part of the points that may lie clearly below the floor."""


class Upright(NamedTuple):
    """How to turn a model so that z is up, the floor, where there is one, at 0."""

    similarity: Similarity
    by: Literal["floor", "cameras"]


def upright(
    T_model_camera: Float64[np.ndarray, "cameras 4 4"], points: Float64[np.ndarray, "points 3"]
) -> Upright:
    """Turn a model upright.

    People hold a camera level: its x axis is horizontal, so that up is what all x axes lack most.
    The floor is the plane below the cameras, about level, that holds many points and has few below.
    """
    up = _held(T_model_camera)
    distance = _distance(T_model_camera)
    floor = _floor(points, T_model_camera[:, :3, 3], up, distance)
    if floor is None:
        return Upright(Similarity(1.0, shortest_turn(up, _Z), np.zeros(3)), "cameras")
    normal, height = floor
    return Upright(
        Similarity(1.0, shortest_turn(normal, _Z), np.array([0.0, 0.0, -height])), "floor"
    )


def looked_at(T_world_camera: Float64[np.ndarray, "cameras 4 4"]) -> Float64[np.ndarray, "3"]:
    """The point that the axes of most cameras pass closely."""
    eye, ahead = T_world_camera[:, :3, 3], T_world_camera[:, :3, 2]
    across = np.eye(3) - ahead[:, :, None] * ahead[:, None, :]
    weight = np.ones(len(eye))
    point = eye.mean(axis=0)
    for _ in range(10):
        A = np.einsum("n,nij->ij", weight, across)
        b = np.einsum("n,nij,nj->i", weight, across, eye)
        point = np.linalg.lstsq(A, b)[0]
        off = np.linalg.norm(np.einsum("nij,nj->ni", across, point - eye), axis=1)
        weight = 1 / (1 + (off / max(float(np.median(off)), 1e-9)) ** 2)
    return point


def _distance(T_world_camera: Float64[np.ndarray, "cameras 4 4"]) -> float:
    away = T_world_camera[:, :3, 3] - looked_at(T_world_camera)
    return float(np.median(np.linalg.norm(away, axis=1)))


def _held(T: Float64[np.ndarray, "cameras 4 4"]) -> Float64[np.ndarray, "3"]:
    right, top = T[:, :3, 0], -T[:, :3, 1].mean(axis=0)
    up = np.linalg.eigh(right.T @ right)[1][:, 0]
    # Few places leave the x axes nearly parallel: then only the tops say anything.
    if abs(up @ top) < 0.5 * np.linalg.norm(top):
        up = top / np.linalg.norm(top)
    return up * np.sign(up @ top)


def _floor(
    points: Float64[np.ndarray, "points 3"],
    eyes: Float64[np.ndarray, "cameras 3"],
    up: Float64[np.ndarray, "3"],
    distance: float,
) -> tuple[Float64[np.ndarray, "3"], float] | None:
    """Normal of the floor and its height along it, in the model's frame."""
    rng = np.random.default_rng(0)
    below = points[points @ up < np.median(eyes @ up)]
    if len(below) < 30:
        return None
    thick, best, most = _THICK * distance, None, 0
    for _ in range(_DRAWS):
        a, b, c = below[rng.choice(len(below), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        size = np.linalg.norm(normal)
        if size < 1e-12 or abs(normal @ up) < _TILT * size:
            continue
        normal *= np.sign(normal @ up) / size
        height = below @ normal - a @ normal
        on = int((np.abs(height) < thick).sum())
        if on > most and (height < -4 * thick).mean() < _BELOW:
            best, most = (normal, float(a @ normal)), on
    if best is None or most < _SHARE * len(points):
        return None
    return _fitted(below, *best, thick)


def _fitted(
    points: Float64[np.ndarray, "points 3"], normal: np.ndarray, height: float, thick: float
) -> tuple[Float64[np.ndarray, "3"], float]:
    """The plane through all points that are near it."""
    for _ in range(5):
        on = points[np.abs(points @ normal - height) < thick]
        middle = on.mean(axis=0)
        fresh = np.linalg.svd(on - middle, full_matrices=False)[2][2]
        normal = fresh * np.sign(fresh @ normal)
        height = float(middle @ normal)
    return normal, height
