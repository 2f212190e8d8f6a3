"""The metre of a scan, by poses, depth or a known height, and its vertical."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float64

from ingest.scan.cameras.features import Length, Sight
from ingest.scan.scan_types import Scale, View
from ingest.uncertainty import rotation, rotation_vector, skew
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import shortest_turn

_JITTER, _WALK = 0.002, 0.003
"""Errors of a phone's positions: of each by itself (m), and what is added each metre walked (m)."""
_TURN = np.radians(0.3)
"""Error of each of its rotations, rad."""
_JUMP = 5.0
"""Sigmas of a step beyond which the phone has corrected itself there, and the step says nothing."""
_ROUNDS = 8
ARKIT_SCALE = 0.004
"""Standard deviation of the length of ARKit's metre, which its own poses do not show, as a part."""


@dataclass(frozen=True)
class Similarity:
    """a = scale R b + t."""

    scale: float
    R: Float64[np.ndarray, "3 3"]
    t: Float64[np.ndarray, "3"]
    sigma: float = 0.0
    """Sigma of the scale, as a part of it."""

    def points(self, b: Float64[np.ndarray, "points 3"]) -> Float64[np.ndarray, "points 3"]:
        """Points of b in a."""
        return self.scale * b @ self.R.T + self.t

    def poses(self, T_b_c: Float64[np.ndarray, "poses 4 4"]) -> Float64[np.ndarray, "poses 4 4"]:
        """Rigid poses in b as poses in a."""
        T = T_b_c.copy()
        T[:, :3, :3] = self.R @ T_b_c[:, :3, :3]
        T[:, :3, 3] = self.points(T_b_c[:, :3, 3])
        return T


def to_phone(
    T_phone_camera: Float64[np.ndarray, "poses 4 4"],
    T_model_camera: Float64[np.ndarray, "poses 4 4"],
) -> Similarity:
    """The similarity that lays a model's cameras on those of a phone's log, the same in their order.

    A phone's errors walk: far poses differ by centimetres where neighbours agree to millimetres. So
    it is steps that count, not places (generalised least squares); steps at which the phone has
    corrected its world are left out. Rotations count too, and settle what a straight path leaves open.
    """
    found = _start(T_phone_camera, T_model_camera)
    length = np.linalg.norm(np.diff(T_model_camera[:, :3, 3], axis=0), axis=1)
    jump = np.zeros(len(length))
    for _ in range(_ROUNDS):
        walk = _WALK**2 * found.scale * length + jump
        found, off = _step(found, T_phone_camera, T_model_camera, walk)
        jump = _jumps(off, walk)
    return found


def _step(
    now: Similarity,
    T_phone_camera: Float64[np.ndarray, "poses 4 4"],
    T_model_camera: Float64[np.ndarray, "poses 4 4"],
    walk: Float64[np.ndarray, " steps"],
) -> tuple[Similarity, Float64[np.ndarray, "poses 3"]]:
    """A step of Gauss and Newton, and how far positions were off before it."""
    turned = now.scale * T_model_camera[:, :3, 3] @ now.R.T
    off = T_phone_camera[:, :3, 3] - turned - now.t
    back = (now.R @ T_model_camera[:, :3, :3]).swapaxes(1, 2)
    twist = rotation_vector(T_phone_camera[:, :3, :3] @ back)
    J = np.zeros((len(off), 3, 7))
    J[:, :, :3], J[:, :, 3], J[:, :, 4:] = -skew(turned), turned, np.eye(3)
    L = np.linalg.cholesky(_covariance(walk))
    white = np.linalg.solve(L, off)
    white_J = np.linalg.solve(L, J.reshape(len(off), -1)).reshape(J.shape)
    weight = _cauchy(np.linalg.norm(twist, axis=1) / _TURN) / _TURN**2
    normal = np.einsum("nki,nkj->ij", white_J, white_J)
    normal[:3, :3] += np.eye(3) * weight.sum()
    right = np.einsum("nki,nk->i", white_J, white)
    right[:3] += (weight[:, None] * twist).sum(axis=0)
    step = np.linalg.solve(normal, right)
    # Where positions err more than a phone's do, the scale is less sure by as much.
    variance = np.linalg.inv(normal)[3, 3] * max(1.0, float((white**2).mean()))
    sigma = float(np.sqrt(variance + ARKIT_SCALE**2))
    scale = now.scale * float(np.exp(step[3]))
    return Similarity(scale, rotation(step[:3]) @ now.R, now.t + step[4:], sigma), off


def _covariance(walk: Float64[np.ndarray, " steps"]) -> Float64[np.ndarray, "poses poses"]:
    """Covariance of one axis of all positions: independent errors, and a random walk."""
    carried = np.concatenate([[0.0], np.cumsum(walk)])
    return np.minimum.outer(carried, carried) + _JITTER**2 * np.eye(len(carried))


def _jumps(
    off: Float64[np.ndarray, "poses 3"], walk: Float64[np.ndarray, " steps"]
) -> Float64[np.ndarray, " steps"]:
    """Variance to add to steps that are farther off than walking explains."""
    step = np.linalg.norm(np.diff(off, axis=0), axis=1)
    usual = np.sqrt(3 * (walk + 2 * _JITTER**2))
    usual = np.maximum(usual, np.median(step))
    return np.where(step > _JUMP * usual, 100 * step**2, 0.0)


def _cauchy(sigmas: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, " n"]:
    return 1 / (1 + (sigmas / 3) ** 2)


def _start(
    T_phone_camera: Float64[np.ndarray, "poses 4 4"],
    T_model_camera: Float64[np.ndarray, "poses 4 4"],
) -> Similarity:
    """Rotation by the rotations, which no path leaves open; scale and place by medians."""
    R_each = T_phone_camera[:, :3, :3] @ T_model_camera[:, :3, :3].swapaxes(1, 2)
    R = _typical(R_each)
    ours, theirs = T_model_camera[:, :3, 3] @ R.T, T_phone_camera[:, :3, 3]
    spread = [np.linalg.norm(x - np.median(x, axis=0), axis=1) for x in (theirs, ours)]
    scale = float(np.median(spread[0]) / max(float(np.median(spread[1])), 1e-12))
    return Similarity(scale, R, np.median(theirs - scale * ours, axis=0))


def _typical(R: Float64[np.ndarray, "n 3 3"]) -> Float64[np.ndarray, "3 3"]:
    """The rotation with which most of the others agree."""
    traces = np.einsum("nij,mij->nm", R, R).clip(-1, 3)
    return R[int(np.median(np.arccos(((traces - 1) / 2).clip(-1, 1)), axis=1).argmin())]


_MIN_ANGLE = np.radians(2.0)
"""Between the rays of a point."""
_PICKED = 2.0
"""Standard deviation of a picked point, pixels."""


def by_length(views: Sequence[View], length: Length) -> tuple[float, Scale]:
    """Metres per unit of the model, from a length between two picked points.

    Raises:
        InputError: "scan-length-picture" for a picture that is not there, "scan-length" when the
            points cannot be placed.
    """
    by_name = {view.name: view for view in views} | {Path(v.name).stem: v for v in views}
    ends: list[np.ndarray] = []
    for name, sights in (("first", length.a), ("second", length.b)):
        end = crossing([_sight(sight, by_name) for sight in sights])
        if end is None:
            raise InputError(
                "scan-length",
                f"The {name} point of the length cannot be placed: its pictures were taken from "
                "nearly one place, or there is only one.",
                field="length",
                fix="Pick each point in two or three pictures taken from different sides.",
            )
        ends.append(end)
    units = float(np.linalg.norm(ends[1] - ends[0]))
    away = [np.linalg.norm(view.T_world_camera[:3, 3] - ends[0]) for view in views]
    off = _PICKED / float(np.median([view.intrinsics[0] for view in views])) * np.median(away)
    sigma = float(off / max(units, 1e-9))
    scale = Scale(sigma, "length", f"a length of {length.metres:g} m between two picked points")
    return length.metres / units, scale


def _sight(sight: Sight, by_name: Mapping[str, View]) -> tuple[View, np.ndarray]:
    if sight.picture not in by_name:
        raise InputError(
            "scan-length-picture",
            f"No registered picture is called {sight.picture!r}.",
            field="length",
            fix="Pick the points in pictures of the work folder that are registered.",
        )
    return by_name[sight.picture], np.array([sight.x, sight.y])


def crossing(
    sights: Sequence[tuple[View, Float64[np.ndarray, "2"]]],
) -> Float64[np.ndarray, "3"] | None:
    """Return the place where the rays of a point meet; None if they are nearly parallel or meet behind."""
    if len(sights) < 2:
        return None
    eyes = np.array([view.T_world_camera[:3, 3] for view, _ in sights])
    rays = np.array([_ray(view, pixel) for view, pixel in sights])
    cosine = (rays @ rays.T).min()
    if np.arccos(np.clip(cosine, -1, 1)) < _MIN_ANGLE:
        return None
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    point = np.linalg.solve(across.sum(axis=0), np.einsum("nij,nj->i", across, eyes))
    ahead = ((point - eyes) * rays).sum(axis=1) > 0
    return point if ahead.all() else None


def _ray(view: View, pixel: Float64[np.ndarray, "2"]) -> Float64[np.ndarray, "3"]:
    fx, fy, cx, cy = view.intrinsics
    ray = view.T_world_camera[:3, :3] @ [(pixel[0] - cx) / fx, (pixel[1] - cy) / fy, 1.0]
    return ray / np.linalg.norm(ray)


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
