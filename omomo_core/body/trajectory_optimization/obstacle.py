"""The mesh as an obstacle of the optimization, and the spheres that stand for the body's flesh.

The dense ones are fitted to the shipped body: each sphere touches the skin from within, and most of the skin
is less than a centimetre from one of them. They follow the bones of any other body.
"""

from dataclasses import dataclass
from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.geometry.distance_field import DistanceField

_Depth = tuple[Float[Tensor, "times flesh"], Float[Tensor, "times flesh 3"]]


@dataclass(frozen=True)
class BoxObstacle:
    """An object made of boxes along its axes."""

    low: Float[Tensor, "parts 3"]
    high: Float[Tensor, "parts 3"]

    @property
    def middle(self) -> Float[Tensor, "3"]:
        """Middle of the box around all parts."""
        return (self.low.amin(dim=0) + self.high.amax(dim=0)) / 2

    def depth(
        self, points: Float[Tensor, "times flesh 3"], radii: Float[Tensor, " flesh"]
    ) -> _Depth:
        """Return each sphere's depth in the box it is deepest in (negative: apart), and the direction out."""
        middle, half = (self.low + self.high) / 2, (self.high - self.low) / 2
        local = points[:, :, None] - middle
        beyond = local.abs() - half
        outside = beyond.clamp(min=0.0).norm(dim=-1)
        depth, part = (radii[:, None] - outside - beyond.amax(dim=-1).clamp(max=0.0)).max(dim=-1)
        index = part[..., None, None].expand(*part.shape, 1, 3)
        local, beyond = local.gather(2, index)[:, :, 0], beyond.gather(2, index)[:, :, 0]
        nearest = torch.nn.functional.one_hot(beyond.argmax(dim=-1), 3)
        inside = (beyond.amax(dim=-1, keepdim=True) <= 0).to(beyond)
        way = inside * nearest + (1 - inside) * beyond.clamp(min=0.0)
        return depth, torch.nn.functional.normalize(way * local.sign(), dim=-1)


@dataclass(frozen=True)
class MeshObstacle:
    """A mesh, as the signed distance to its surface."""

    field: DistanceField
    middle: Float[Tensor, "3"]

    def depth(
        self, points: Float[Tensor, "times flesh 3"], radii: Float[Tensor, " flesh"]
    ) -> _Depth:
        """Return each sphere's depth inside (negative: apart), and the direction out by the gradient.

        The direction is zero for spheres that never touch.
        """
        depth = radii - self.field.at(points)
        hit, away = (depth > 0).any(dim=0), torch.zeros_like(points)
        away[:, hit] = self.field.away(points[:, hit])
        return depth, away


Obstacle = BoxObstacle | MeshObstacle


STATURE = 1.72
"""Stature of the body whose spheres these are, metres."""


class BodySphere(NamedTuple):
    """A sphere beside a bone, metres."""

    start: str
    end: str
    share: float
    """Share of the way from joint to joint; beyond 1 it is farther on."""
    offset: tuple[float, float, float]
    """From there, at rest (x to the left, y up, z ahead); turns with the joint `start`."""
    radius: float


_MIDDLE = (
    BodySphere("pelvis", "spine1", -0.3, (0.0, 0.0, 0.026), 0.09),
    BodySphere("spine3", "neck", 0.25, (0.0, 0.0, 0.044), 0.088),
    BodySphere("spine3", "neck", 0.94, (0.0, 0.0, 0.015), 0.053),
    BodySphere("neck", "head", 0.29, (0.0, -0.005, 0.016), 0.047),
    BodySphere("head", "head", 0.0, (0.0, -0.092, 0.042), 0.026),
    BodySphere("head", "head", 0.0, (0.0, -0.036, -0.006), 0.072),
    BodySphere("head", "head", 0.0, (0.0, -0.015, 0.029), 0.069),
    BodySphere("head", "head", 0.0, (0.0, 0.033, -0.019), 0.079),
    BodySphere("head", "head", 0.0, (0.0, 0.048, 0.029), 0.058),
)
_LEFT = (
    BodySphere("pelvis", "spine1", -0.36, (0.058, 0.0, 0.003), 0.105),
    BodySphere("pelvis", "spine1", 0.45, (0.07, 0.0, 0.017), 0.085),
    BodySphere("spine1", "spine2", 0.0, (0.04, 0.0, 0.024), 0.09),
    BodySphere("spine1", "spine2", 0.6, (0.044, 0.004, 0.033), 0.09),
    BodySphere("spine2", "spine3", 0.33, (0.047, 0.012, 0.046), 0.101),
    BodySphere("spine2", "spine3", 0.9, (0.1, 0.01, 0.038), 0.079),
    BodySphere("spine3", "neck", -0.03, (0.066, -0.012, 0.078), 0.093),
    BodySphere("spine3", "neck", 0.21, (0.082, -0.004, 0.028), 0.09),
    BodySphere("spine3", "neck", 0.54, (0.07, 0.0, 0.0), 0.057),
    BodySphere("left_hip", "left_knee", 0.08, (-0.031, 0.0, 0.012), 0.096),
    BodySphere("left_hip", "left_knee", 0.24, (-0.013, 0.0, 0.022), 0.088),
    BodySphere("left_hip", "left_knee", 0.4, (-0.013, 0.0, 0.023), 0.084),
    BodySphere("left_hip", "left_knee", 0.57, (-0.011, 0.0, 0.02), 0.079),
    BodySphere("left_hip", "left_knee", 0.81, (-0.01, 0.0, 0.006), 0.065),
    BodySphere("left_hip", "left_knee", 0.99, (-0.006, 0.0, 0.0), 0.052),
    BodySphere("left_knee", "left_ankle", 0.16, (0.007, 0.0, -0.021), 0.055),
    BodySphere("left_knee", "left_ankle", 0.36, (0.008, 0.0, -0.023), 0.058),
    BodySphere("left_knee", "left_ankle", 0.54, (0.012, 0.0, -0.019), 0.051),
    BodySphere("left_knee", "left_ankle", 0.7, (0.014, 0.0, -0.014), 0.038),
    BodySphere("left_knee", "left_ankle", 0.9, (0.008, 0.0, -0.004), 0.033),
    BodySphere("left_ankle", "left_foot", 0.0, (0.006, -0.04, -0.013), 0.035),
    BodySphere("left_ankle", "left_foot", 0.15, (0.008, -0.028, -0.009), 0.037),
    BodySphere("left_ankle", "left_foot", 0.39, (0.006, -0.017, -0.005), 0.041),
    BodySphere("left_ankle", "left_foot", 0.77, (-0.007, -0.011, -0.004), 0.03),
    BodySphere("left_ankle", "left_foot", 0.8, (0.031, -0.014, -0.004), 0.025),
    BodySphere("left_ankle", "left_foot", 1.19, (-0.016, -0.003, 0.0), 0.02),
    BodySphere("left_ankle", "left_foot", 1.05, (0.02, -0.01, 0.0), 0.02),
    BodySphere("left_shoulder", "left_elbow", -0.21, (0.0, -0.023, -0.014), 0.075),
    BodySphere("left_shoulder", "left_elbow", 0.06, (0.0, -0.013, -0.004), 0.064),
    BodySphere("left_shoulder", "left_elbow", 0.36, (0.0, -0.004, -0.008), 0.046),
    BodySphere("left_shoulder", "left_elbow", 0.56, (0.0, -0.003, 0.0), 0.042),
    BodySphere("left_shoulder", "left_elbow", 0.78, (0.0, -0.003, 0.004), 0.04),
    BodySphere("left_elbow", "left_wrist", 0.03, (0.0, -0.002, 0.007), 0.038),
    BodySphere("left_elbow", "left_wrist", 0.29, (0.0, 0.001, 0.005), 0.038),
    BodySphere("left_elbow", "left_wrist", 0.5, (0.0, 0.002, 0.001), 0.034),
    BodySphere("left_elbow", "left_wrist", 0.72, (0.0, 0.002, -0.001), 0.029),
    BodySphere("left_elbow", "left_wrist", 0.9, (0.0, 0.0, 0.001), 0.025),
    BodySphere("left_elbow", "left_wrist", 1.04, (0.0, 0.0, 0.0), 0.024),
)


def _mirrored(sphere: BodySphere) -> BodySphere:
    x, y, z = sphere.offset
    start, end = (name.replace("left", "right") for name in (sphere.start, sphere.end))
    return BodySphere(start, end, sphere.share, (-x, y, z), sphere.radius)


DENSE_SPHERES = (*_MIDDLE, *_LEFT, *(_mirrored(sphere) for sphere in _LEFT))
_ROWS = (
    ("pelvis", "pelvis", 0.0, 0.115), ("pelvis", "spine2", 0.6, 0.11),
    ("spine2", "spine3", 0.7, 0.115), ("spine3", "neck", 0.5, 0.115),
    ("neck", "head", 2.4, 0.09), ("spine3", "spine3", 0.0, 0.11),
    *(row for s in ("left", "right") for row in (
        (f"{s}_hip", f"{s}_knee", 0.3, 0.075), (f"{s}_hip", f"{s}_knee", 0.65, 0.065),
        (f"{s}_knee", f"{s}_knee", 0.0, 0.052), (f"{s}_knee", f"{s}_ankle", 0.35, 0.05),
        (f"{s}_knee", f"{s}_ankle", 0.7, 0.042), (f"{s}_ankle", f"{s}_foot", 0.5, 0.045),
        (f"{s}_shoulder", f"{s}_elbow", 0.5, 0.045), (f"{s}_elbow", f"{s}_elbow", 0.0, 0.038),
        (f"{s}_elbow", f"{s}_wrist", 0.5, 0.032),
    )),
)  # fmt: skip
COARSE_SPHERES = tuple(
    BodySphere(a, b, share, (0.0, 0.0, 0.0), radius) for a, b, share, radius in _ROWS
)
"""Coarse spheres along the bones, for the synthesis; the skull is beyond its joint.

Radii from segment girths (NASA-STD-3000 anthropometry), less what soft tissue gives in contact.
"""
