"""The view of the hands: a camera that keeps close to what holds."""

import igl
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter1d

from omomo_core.geometry.transforms import to_local
from omomo_core.motion import HumanMotion, ObjectMotion
from omomo_core.skeleton import joint
from render.cameras import Camera, look_at, pinhole

_WRISTS = [joint("left_wrist"), joint("right_wrist")]
_PALMS = slice(22, 24)
_BOTH = 0.4
"""Distance of palms up to which both are in the picture, metres."""
_DISTANCE, _MARGIN = 0.5, 1.1
"""From a single hand, metres; and for each metre between two."""
_WAYS = (
    (0.55, 0.75, 0.35), (0.75, 0.2, 0.35), (0.3, 0.9, 0.0), (0.3, 0.3, 1.0), (0.55, -0.6, 0.35),
    (0.75, 0.2, -0.3), (-0.55, 0.75, 0.35), (0.1, -0.9, 0.2), (0.2, 0.2, -1.0),
    (-0.3, -0.8, 0.35), (-0.2, 0.3, 1.0), (0.1, 0.9, 0.6),
)  # fmt: skip
"""Parts of the back of the hand, the thumb's side and upwards in where the camera may stand: the first from
which little is hidden is taken, as the first shows fingers and thumb on what they hold."""
_SEEN = 0.8
"""Share of the hands from which on little is hidden."""
_REACH, _HALF = 0.06, 0.035
"""From a palm to the middle of the fingers and to the rims of the hand, metres."""
_TRUNK = [joint(n) for n in ("pelvis", "spine1", "spine2", "spine3", "neck", "head")]
_THIGHS = (
    [joint(n) for n in ("left_hip", "right_hip")],
    [joint(n) for n in ("left_knee", "right_knee")],
)
_GIRTH = 0.14
"""Radius of trunk, head and thighs, metres."""
_LOWEST = 0.05
"""Of the camera above the floor, metres."""
_STRIDE = 10
"""Frames between those in which it is looked whether something hides the hands."""
_FOV = 0.5
"""Vertical field of view, radians."""
_SMOOTHING = 10.0
"""Standard deviation of the filter over the camera's path, frames."""


def hand_cameras(human: HumanMotion, moved: ObjectMotion, width: int, height: int) -> list[Camera]:
    """Return one camera per frame that looks at both hands if they are near each other, else at one.

    It looks at the hand that holds for longer, from a side on which neither the object nor the body hides it.

    Args:
        human: whose hands.
        moved: the object, in the same frames.
        width, height: of the pictures, pixels.
    """
    palms = human.joints[:, _PALMS]
    shown = _shown(palms, human.hand_contact)
    target = gaussian_filter1d(palms[:, shown].mean(axis=1), _SMOOTHING, axis=0, mode="nearest")
    apart = (
        np.linalg.norm(np.ptp(palms[:, shown], axis=1), axis=-1).max() if len(shown) > 1 else 0.0
    )
    far, best, eye = _DISTANCE + _MARGIN * apart, -1.0, target
    for parts in _WAYS:
        tried = target + far * _way(human, shown, parts)
        seen = _seen(human, moved, shown, tried)
        if seen > best:
            best, eye = seen, tried
        if seen >= _SEEN:
            break
    return [pinhole(look_at(eye[k], target[k]), _FOV, width, height) for k in range(len(eye))]


def _way(
    human: HumanMotion, shown: list[int], parts: tuple[float, float, float]
) -> Float[np.ndarray, "frames 3"]:
    """Return the direction from the hands to the camera."""
    back, thumb, up = parts
    R = human.rotations[:, _WRISTS][:, shown]
    way = (back * R[..., 1] + thumb * R[..., 2]).mean(axis=1)
    way[:, 2] += up
    way = gaussian_filter1d(way, _SMOOTHING, axis=0, mode="nearest")
    return way / np.linalg.norm(way, axis=1, keepdims=True)


def _seen(
    human: HumanMotion, moved: ObjectMotion, shown: list[int], eye: Float[np.ndarray, "frames 3"]
) -> float:
    """Return the share of the hands that hold which neither the object nor the body hides."""
    held = np.flatnonzero((human.hand_contact[:, shown] > 0.5).any(axis=1))[::_STRIDE]
    if not len(held):
        return 1.0
    palms = human.joints[held][:, _PALMS][:, shown]
    along = palms - human.joints[held][:, _WRISTS][:, shown]
    along *= _REACH / np.linalg.norm(along, axis=-1, keepdims=True)
    across = _HALF * human.rotations[held][:, _WRISTS][:, shown][..., 2]
    points = np.stack([palms, palms + along, palms + across, palms - across], axis=2)
    points = points.reshape(len(held), -1, 3)
    way = eye[held, None] - points
    hidden = _behind_object(moved, held, points, way)
    hidden |= _behind_body(human.joints[held], points, way) | (eye[held, None, 2] < _LOWEST)
    return 1.0 - float(hidden.mean())


def _behind_object(
    moved: ObjectMotion,
    held: Int[np.ndarray, " held"],
    points: Float[np.ndarray, "held points 3"],
    way: Float[np.ndarray, "held points 3"],
) -> Bool[np.ndarray, "held points"]:
    T = moved.T_world_object[held]
    start, end = to_local(T, points), to_local(T, points + way)
    vertices, faces = moved.mesh.vertices.astype(float), moved.mesh.faces.astype(np.int64)
    tree = igl.AABB()
    tree.init(vertices, faces)
    rays = start.reshape(-1, 3), (end - start).reshape(-1, 3)
    triangle = np.asarray(tree.intersect_ray_first(vertices, faces, *rays)[0])
    return (triangle != -1).reshape(points.shape[:2])


def _behind_body(
    joints: Float[np.ndarray, "held 24 3"],
    points: Float[np.ndarray, "held points 3"],
    way: Float[np.ndarray, "held points 3"],
) -> Bool[np.ndarray, "held points"]:
    hips, knees = (joints[:, some] for some in _THIGHS)
    thick = np.concatenate([joints[:, _TRUNK], hips, 0.5 * (hips + knees), knees], axis=1)
    to_joint = thick[:, None] - points[:, :, None]
    share = (to_joint * way[:, :, None]).sum(axis=-1) / (way**2).sum(axis=-1)[..., None]
    beside = to_joint - share.clip(0.0, 1.0)[..., None] * way[:, :, None]
    return (np.linalg.norm(beside, axis=-1) < _GIRTH).any(axis=-1)


def _shown(
    palms: Float[np.ndarray, "frames 2 3"], contact: Float[np.ndarray, "frames 2"]
) -> list[int]:
    """Return which hands to look at: 0 left, 1 right."""
    both = contact.min(axis=1) > 0.5
    if both.any():
        apart = np.linalg.norm(palms[both, 0] - palms[both, 1], axis=-1)
        if np.percentile(apart, 90) < _BOTH:
            return [0, 1]
    return [int(contact[:, 1].sum() > contact[:, 0].sum())]
