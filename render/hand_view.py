"""The view of the hands: a camera that keeps close to what holds."""

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d

from omomo_core.motion import HumanMotion
from omomo_core.skeleton import joint
from render.cameras import Camera, look_at, pinhole

_WRISTS = [joint("left_wrist"), joint("right_wrist")]
_PALMS = slice(22, 24)
_BOTH = 0.4
"""Distance of palms up to which both are in the picture, metres."""
_DISTANCE, _MARGIN = 0.5, 1.1
"""From a single hand, metres; and for each metre between two."""
_BACK, _THUMB, _UP = 0.55, 0.75, 0.35
"""Parts of the back of the hand, the thumb's side and upwards in where the camera stands."""
_FOV = 0.5
"""Vertical field of view, radians."""
_SMOOTHING = 10.0
"""Standard deviation of the filter over the camera's path, frames."""


def hand_cameras(human: HumanMotion, width: int, height: int) -> list[Camera]:
    """Return one camera per frame that looks at both hands if they are near each other, else at one.

    It looks at the hand that holds for longer, from its back and the thumb's side, where fingers and thumb
    are seen on what they hold.

    Args:
        human: whose hands.
        width, height: of the pictures, pixels.
    """
    palms = human.joints[:, _PALMS]
    shown = _shown(palms, human.hand_contact)
    R = human.rotations[:, _WRISTS][:, shown]
    way = (_BACK * R[..., 1] + _THUMB * R[..., 2]).mean(axis=1)
    way[:, 2] += _UP
    target, way = (
        gaussian_filter1d(x, _SMOOTHING, axis=0, mode="nearest")
        for x in (palms[:, shown].mean(axis=1), way)
    )
    apart = (
        np.linalg.norm(np.ptp(palms[:, shown], axis=1), axis=-1).max() if len(shown) > 1 else 0.0
    )
    eye = target + (_DISTANCE + _MARGIN * apart) * way / np.linalg.norm(way, axis=1, keepdims=True)
    return [pinhole(look_at(eye[k], target[k]), _FOV, width, height) for k in range(len(eye))]


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
