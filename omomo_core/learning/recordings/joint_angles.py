"""Angles of elbows, knees, wrists and shoulders, in anatomical terms, for judging poses."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from omomo_core.skeleton import BODY_JOINTS, joint

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")


@dataclass(frozen=True)
class Hinge:
    """Bending of a hinge joint, degrees."""

    flexion: Float[np.ndarray, " frames"]
    """0 straight, positive the natural way, negative beyond straight."""
    aside: Float[np.ndarray, " frames"]
    """Bending to the side, which neither elbows nor knees can."""


def elbow(rotations: Float[np.ndarray, "frames 22 3 3"], side: Side) -> Hinge:
    """Bending of an elbow against the upper arm's own hinge axis."""
    across = 1.0 if side == "left" else -1.0
    bone, hinge = np.array([across, 0.0, 0.0]), np.array([0.0, -across, 0.0])
    return _hinge(rotations, f"{side}_shoulder", f"{side}_elbow", bone, hinge)


def knee(rotations: Float[np.ndarray, "frames 22 3 3"], side: Side) -> Hinge:
    """Bending of a knee against the thigh's own hinge axis."""
    bone, hinge = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])
    return _hinge(rotations, f"{side}_hip", f"{side}_knee", bone, hinge)


def _hinge(
    rotations: Float[np.ndarray, "frames 22 3 3"],
    above: str,
    name: str,
    bone: Float[np.ndarray, " 3"],
    hinge: Float[np.ndarray, " 3"],
) -> Hinge:
    upper, lower = rotations[:, joint(above)], rotations[:, joint(name)]
    along = np.einsum("tji,tj->ti", upper, lower @ bone)
    # Measured from the half turn: 170 degrees of flexion must not read as -190.
    flexion = np.degrees(np.arctan2(along @ np.cross(hinge, bone), along @ bone))
    flexion = np.where(flexion < -90.0, flexion + 360.0, flexion)
    return Hinge(flexion, np.degrees(np.arcsin((along @ hinge).clip(-1.0, 1.0))))


def twist(
    rotations: Float[np.ndarray, "frames 22 3 3"], name: str, above: str
) -> Float[np.ndarray, " frames"]:
    """Turn of an arm's joint about its own bone against the joint above, degrees, 0 in the T-pose."""
    assert name in BODY_JOINTS
    turned = np.swapaxes(rotations[:, joint(above)], -1, -2) @ rotations[:, joint(name)]
    # The part of the quaternion along x, the bone's axis: swing-twist decomposition.
    x = turned[:, 2, 1] - turned[:, 1, 2]
    w = 1.0 + turned[:, 0, 0] + turned[:, 1, 1] + turned[:, 2, 2]
    return np.degrees(2.0 * np.arctan2(x, w))


def wrist(joints: Float[np.ndarray, "frames 24 3"], side: Side) -> Float[np.ndarray, " frames"]:
    """Angle between forearm and hand, degrees, 0 straight."""
    k = SIDES.index(side)
    a, b = joints[:, 20 + k] - joints[:, 18 + k], joints[:, 22 + k] - joints[:, 20 + k]
    cosine = (a * b).sum(-1) / (np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1))
    return np.degrees(np.arccos(cosine.clip(-1.0, 1.0)))
