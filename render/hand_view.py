"""The view of the hands: a camera that keeps close to what holds."""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d

from omomo_core.geometry.surface import Triangles
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
_DIRECTIONS = (
    (0.55, 0.75, 0.35), (0.75, 0.2, 0.35), (0.3, 0.9, 0.0), (0.3, 0.3, 1.0), (0.55, -0.6, 0.35),
    (0.75, 0.2, -0.3), (-0.55, 0.75, 0.35), (0.1, -0.9, 0.2), (0.2, 0.2, -1.0),
    (-0.3, -0.8, 0.35), (-0.2, 0.3, 1.0), (0.1, 0.9, 0.6),
)  # fmt: skip
"""From the hands to the camera, the best view first: how much along the back of the hand, along the thumb's
side, and upwards."""
_SEEN = 0.8
"""Visible share of the hands that is enough, so that no further direction is tried."""
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
"""Least height of the camera above the floor, metres."""
_STRIDE = 10
"""Interval of the frames in which visibility is tested."""
_FOV = 0.5
"""Vertical field of view, radians."""
_TARGET_SMOOTHING, _SMOOTHING = 4.0, 10.0
"""Standard deviation of the filters over what the camera looks at and over its direction, frames."""


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
    target = palms[:, shown].mean(axis=1)
    target = gaussian_filter1d(target, _TARGET_SMOOTHING, axis=0, mode="nearest")
    apart = (
        np.linalg.norm(np.ptp(palms[:, shown], axis=1), axis=-1).max() if len(shown) > 1 else 0.0
    )
    far, most, eye = _DISTANCE + _MARGIN * apart, -1.0, target
    surface = Triangles(moved.mesh.vertices, moved.mesh.faces)
    for parts in _DIRECTIONS:
        tried = target + far * _direction(human, shown, parts)
        seen = _visible_share(human, moved, surface, shown, tried)
        if seen > most:
            most, eye = seen, tried
        if seen >= _SEEN:
            break
    return [pinhole(look_at(eye[k], target[k]), _FOV, width, height) for k in range(len(eye))]


def _direction(
    human: HumanMotion, shown: list[int], parts: tuple[float, float, float]
) -> Float[np.ndarray, "frames 3"]:
    """Return the direction from the hands to the camera."""
    back, thumb, up = parts
    R = human.rotations[:, _WRISTS][:, shown]
    direction = (back * R[..., 1] + thumb * R[..., 2]).mean(axis=1)
    direction[:, 2] += up
    direction = gaussian_filter1d(direction, _SMOOTHING, axis=0, mode="nearest")
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


def _visible_share(
    human: HumanMotion,
    moved: ObjectMotion,
    surface: Triangles,
    shown: list[int],
    eye: Float[np.ndarray, "frames 3"],
) -> float:
    """Return the share of the holding hands that neither the object nor the body hides from the camera."""
    held = np.flatnonzero((human.hand_contact[:, shown] > 0.5).any(axis=1))[::_STRIDE]
    if not len(held):
        return 1.0
    palms = human.joints[held][:, _PALMS][:, shown]
    along = palms - human.joints[held][:, _WRISTS][:, shown]
    along *= _REACH / np.linalg.norm(along, axis=-1, keepdims=True)
    across = _HALF * human.rotations[held][:, _WRISTS][:, shown][..., 2]
    points = np.stack([palms, palms + along, palms + across, palms - across], axis=2)
    points = points.reshape(len(held), -1, 3)
    eyes = np.broadcast_to(eye[held, None], points.shape)
    T = moved.T_world_object[held]
    hidden = surface.between(to_local(T, points), to_local(T, eyes))
    hidden |= _behind_body(human.joints[held], points, eyes) | (eyes[..., 2] < _LOWEST)
    return 1.0 - float(hidden.mean())


def _behind_body(
    joints: Float[np.ndarray, "held 24 3"],
    points: Float[np.ndarray, "held points 3"],
    eyes: Float[np.ndarray, "held points 3"],
) -> Bool[np.ndarray, "held points"]:
    """Return whether trunk, head or a thigh is between the points and the camera."""
    hips, knees = (joints[:, some] for some in _THIGHS)
    thick = np.concatenate([joints[:, _TRUNK], hips, 0.5 * (hips + knees), knees], axis=1)
    sight, to_joint = (eyes - points)[:, :, None], thick[:, None] - points[:, :, None]
    share = (to_joint * sight).sum(axis=-1) / (sight**2).sum(axis=-1)
    beside = to_joint - share.clip(0.0, 1.0)[..., None] * sight
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
