"""How a hand closes around a pole or a bar: the palm beside it, the thumb along it."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.holds import Hold
from omomo_core.skeleton import PALM_JOINTS, joint

_OBLIQUE = 0.5
"""Cosine of the least angle between the forearm's direction in the hand and the pole: 60 degrees."""
_RADIUS = 0.012
_SIDES = ("left", "right")


@dataclass(frozen=True)
class ToolBar:
    """A straight piece of a prop that hands close around, prop frame."""

    centres: Float[np.ndarray, "2 3"]
    """On its axis, where the left and the right palm go, metres."""
    thumbs: Float[np.ndarray, "2 3"]
    """Which way along the axis each thumb points, unit length."""


def grip_holds(
    body: BodyModel,
    joints: Float[np.ndarray, "frames 24 3"],
    T_world_prop: Float[np.ndarray, "frames 4 4"],
    bar: ToolBar,
    hands: tuple[bool, bool],
    span: tuple[int, int],
    times: tuple[int, int],
) -> tuple[Hold, ...]:
    """Holds of one or both hands on a bar, turned as the forearms will come.

    Args:
        body: whose arms.
        joints: of the base motion, world, metres.
        T_world_prop: the prop's motion.
        bar: where on the prop.
        hands: which hands (left, right) hold it.
        span: first and one past the last frame of contact.
        times: frames of reaching and of releasing.
    """
    holds: list[Hold] = []
    for hand in (h for h in (0, 1) if hands[h]):
        forearm = _forearm(body, joints, T_world_prop, bar.centres[hand], hand, span)
        inward, fingers = around(bar.thumbs[hand], forearm, hand)
        point = bar.centres[hand] - inward * _RADIUS
        holds.append(Hold(hand, *span, point, inward, fingers, *times))
    return tuple(holds)


def around(
    thumb: Float[np.ndarray, " 3"], forearm: Float[np.ndarray, " 3"], hand: int
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Which way palm and fingers of a hand around a bar point, unit length.

    Args:
        thumb: along the bar.
        forearm: from elbow to wrist.
        hand: 0 left, 1 right.
    """
    along = float(np.clip(forearm @ thumb, -_OBLIQUE, _OBLIQUE))
    across = forearm - (forearm @ thumb) * thumb
    across = across / max(float(np.linalg.norm(across)), 1e-9)
    fingers = along * thumb + np.sqrt(1 - along**2) * across
    return np.cross(thumb, across) * (1.0 if hand == 1 else -1.0), fingers


def _forearm(
    body: BodyModel,
    joints: Float[np.ndarray, "frames 24 3"],
    T: Float[np.ndarray, "frames 4 4"],
    centre: Float[np.ndarray, " 3"],
    hand: int,
    span: tuple[int, int],
) -> Float[np.ndarray, " 3"]:
    """Mean direction of a forearm whose elbow hangs down and out, prop frame."""
    rows = slice(*span)
    upper, lower = arm_lengths(body)
    palm = T[rows, :3, :3] @ centre + T[rows, :3, 3]
    shoulder = joints[rows, joint(f"{_SIDES[hand]}_shoulder")]
    other = joints[rows, joint(f"{_SIDES[1 - hand]}_shoulder")]
    to_palm = palm - shoulder
    distance = np.linalg.norm(to_palm, axis=-1, keepdims=True)
    line = to_palm / distance
    far = np.minimum(distance, 0.97 * (upper + lower))
    along = (upper**2 - lower**2 + far**2) / (2 * far)
    aside = np.sqrt(np.maximum(upper**2 - along**2, 0.0))
    down = 0.35 * (shoulder - other) + np.array([0.0, 0.0, -0.4])
    down -= (down * line).sum(-1, keepdims=True) * line
    down /= np.linalg.norm(down, axis=-1, keepdims=True)
    forearm = line * far - (along * line + aside * down)
    mean = np.einsum("tji,tj->i", T[rows, :3, :3], forearm)
    return mean / np.linalg.norm(mean)


def arm_lengths(body: BodyModel) -> tuple[float, float]:
    """Shoulder to elbow, elbow to palm, metres."""
    rest = body.rest_joints.double().numpy()
    chain = [joint("left_shoulder"), joint("left_elbow"), PALM_JOINTS[0]]
    upper, lower = (float(np.linalg.norm(rest[b] - rest[a])) for a, b in pairwise(chain))
    return upper, lower
