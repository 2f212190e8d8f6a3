"""Analytic two-bone solver: put a palm or an ankle exactly where it must be.

Only the global rotations of two joints change (shoulder and elbow, or hip and knee); the hand and
the foot keep their orientation. The limb is first swung as a whole toward the target, then opened
or closed about its hinge, so the pose changes as little as the target allows. Everything is a
formula over any batch: no iteration, gradients flow.
"""

from dataclasses import dataclass
from typing import Literal

import roma
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.body_config import LIMB
from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel
from omomo_core.skeleton import PALM_JOINTS, joint

LimbName = Literal["left_arm", "right_arm", "left_leg", "right_leg"]


@dataclass(frozen=True)
class Limb:
    """Joints of an arm or a leg, as indices of the model's joints."""

    upper: int
    """Shoulder or hip."""
    middle: int
    """Elbow or knee."""
    end: int
    """Wrist or ankle."""
    hinge: tuple[float, float, float]
    """Axis of flexion in the rest pose: elbows bend forward from the T-pose, knees backward."""
    palm: int | None = None


LIMBS: dict[LimbName, Limb] = {
    "left_arm": Limb(
        joint("left_shoulder"),
        joint("left_elbow"),
        joint("left_wrist"),
        (0.0, -1.0, 0.0),
        PALM_JOINTS[0],
    ),
    "right_arm": Limb(
        joint("right_shoulder"),
        joint("right_elbow"),
        joint("right_wrist"),
        (0.0, 1.0, 0.0),
        PALM_JOINTS[1],
    ),
    "left_leg": Limb(joint("left_hip"), joint("left_knee"), joint("left_ankle"), (1.0, 0.0, 0.0)),
    "right_leg": Limb(
        joint("right_hip"), joint("right_knee"), joint("right_ankle"), (1.0, 0.0, 0.0)
    ),
}


def reach(
    body: BodyModel,
    root: Float[Tensor, "*b 3"],
    rotations: Float[Tensor, "*b 22 3 3"],
    limb: LimbName,
    target: Float[Tensor, "*b 3"],
    pole: Float[Tensor, "*b 3"] | None = None,
    weight: Float[Tensor, "*b"] | None = None,
    *,
    gently: bool = False,
) -> tuple[Float[Tensor, "*b 22 3 3"], Float[Tensor, "*b"]]:
    """Return shoulder and elbow (hip and knee) turned so that the palm (ankle) is at the target.

    Args:
        body: whose bone lengths to use.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint of the body joints.
        limb: which arm or leg.
        target: palm joint (arms) or ankle joint (legs), world, metres.
        pole: world direction in which elbow or knee should point; by default the present bend
            plane is carried along (and a straight or overstretched limb bends about its hinge).
        weight: blends along the geodesic from the given rotations (0) to the solved ones (1).
        gently: the limb straightens ever more slowly, some millimetres short of a target at its full
            length, where elbows and knees would snap.

    Returns:
        The rotations with two joints changed, and how far in metres the solved limb (weight 1)
        misses its target because that is too far away, or too close.
    """
    parts = LIMBS[limb]
    offset = body.rest_joints.to(rotations)
    bones = (offset[parts.middle] - offset[parts.upper], offset[parts.end] - offset[parts.middle])
    if parts.palm is not None:
        palm = offset[parts.palm] - offset[parts.end]
        target = target - rotations[..., parts.end, :, :] @ palm
    start = forward_kinematics(body, root, rotations)[..., parts.upper, :]
    turning = (rotations[..., parts.upper, :, :], rotations[..., parts.middle, :, :])
    hinge = turning[0] @ rotations.new_tensor(parts.hinge)
    solved, residual = _solve(bones, turning, hinge, target - start, pole, gently)
    out = rotations.clone()
    for j, old, new in zip((parts.upper, parts.middle), turning, solved, strict=True):
        out[..., j, :, :] = new if weight is None else _blend(old, new, weight)
    return out, residual


_Vec = Float[Tensor, "*b 3"]
_Rot = Float[Tensor, "*b 3 3"]


def forearm_towards(
    body: BodyModel, side: int, R_upper: _Rot, R_fore: _Rot, wrist: _Vec
) -> Float[Tensor, "*b 3 3"]:
    """Return the global rotation of a forearm whose wrist `reach` would bring to a place.

    Args:
        body: whose bone lengths to use.
        side: 0 left, 1 right.
        R_upper: present global rotation of the shoulder joint.
        R_fore: present global rotation of the elbow joint.
        wrist: where the wrist is to be, from the shoulder, world axes, metres.
    """
    parts = LIMBS[("left_arm", "right_arm")[side]]
    rest = body.rest_joints.to(wrist)
    bones = (rest[parts.middle] - rest[parts.upper], rest[parts.end] - rest[parts.middle])
    hinge = R_upper @ wrist.new_tensor(parts.hinge)
    return _solve(bones, (R_upper, R_fore), hinge, wrist, None, gently=True)[0][1]


def _solve(
    bones: tuple[Float[Tensor, " 3"], Float[Tensor, " 3"]],
    turning: tuple[_Rot, _Rot],
    hinge: _Vec,
    goal: _Vec,
    pole: _Vec | None,
    gently: bool,
) -> tuple[tuple[_Rot, _Rot], Float[Tensor, "*b"]]:
    """Return rotations of the two bones that span `goal`, and how far they miss it, metres."""
    upper, fore = turning[0] @ bones[0], turning[1] @ bones[1]
    a, b = bones[0].norm(), bones[1].norm()
    along_old = _unit(upper + fore)
    along = _unit(goal + 1e-9 * along_old)  # a target on the shoulder itself has no direction
    normal_old = _bend_normal(upper / a, fore / b, hinge, along_old)
    normal = _transport(normal_old, along_old, along)
    if pole is not None:
        normal = _perpendicular(torch.linalg.cross(pole, along) + 1e-3 * normal, along)
    carried = _frame(along, normal) @ _frame(along_old, normal_old).mT

    wanted = goal.norm(dim=-1, keepdim=True)
    nearest = (a**2 + b**2 + 2 * a * b * LIMB.folded_cosine).sqrt()
    longest = LIMB.stretch * (a + b)
    reached = _eased(wanted, LIMB.easy * (a + b), longest) if gently else wanted
    span = reached.clamp(min=nearest, max=longest)
    cos = (a**2 + span**2 - b**2) / (2 * a * span)
    upper_new = cos * along + (1 - cos**2).sqrt() * torch.linalg.cross(along, normal)
    fore_new = (span * along - a * upper_new) / b
    solved = (
        _swing(_turn(carried, upper / a), upper_new) @ carried @ turning[0],
        _swing(_turn(carried, fore / b), fore_new) @ carried @ turning[1],
    )
    return solved, (wanted - span)[..., 0].abs()


def _eased(
    length: Float[Tensor, "*b 1"], easy: Float[Tensor, ""], longest: Float[Tensor, ""]
) -> Float[Tensor, "*b 1"]:
    """Return a length that comes ever closer to the longest one from an easy one on."""
    room = longest - easy
    return torch.minimum(length, longest - room * torch.exp((easy - length).clamp(max=0.0) / room))


def _bend_normal(upper: _Vec, fore: _Vec, hinge: _Vec, along: _Vec) -> _Vec:
    """Return the axis about which the limb flexes: that of its present bend, never against the hinge."""
    bend = torch.linalg.cross(upper, fore)
    natural = (bend * hinge).sum(-1, keepdim=True)
    return _perpendicular(bend + (LIMB.straight_sine - natural).clamp(min=0.0) * hinge, along)


def _transport(normal: _Vec, old: _Vec, new: _Vec) -> _Vec:
    """Return `normal`, carried along by the smallest rotation from unit vector `old` to `new`."""
    opening = 1 + (old * new).sum(-1, keepdim=True)
    moved = normal - (normal * new).sum(-1, keepdim=True) / opening.clamp(min=1e-6) * (old + new)
    return _perpendicular(moved, new)


def _swing(old: _Vec, new: _Vec) -> _Rot:
    """Return the smallest rotation between unit vectors (not opposite ones), batched and with gradients."""
    axis = torch.linalg.cross(old, new)
    cos = (old * new).sum(-1)[..., None, None]
    K = _cross_matrix(axis)
    return torch.eye(3).to(K) + K + K @ K / (1 + cos).clamp(min=1e-6)


def _blend(old: _Rot, new: _Rot, weight: Float[Tensor, "*b"]) -> _Rot:
    step = roma.rotmat_to_rotvec(old.mT @ new)
    return old @ roma.rotvec_to_rotmat(weight[..., None] * step)


def _cross_matrix(v: _Vec) -> _Rot:
    x, y, z = v.unbind(-1)
    o = torch.zeros_like(x)
    return torch.stack([o, -z, y, z, o, -x, -y, x, o], dim=-1).unflatten(-1, (3, 3))


def _frame(along: _Vec, normal: _Vec) -> _Rot:
    return torch.stack([along, normal, torch.linalg.cross(along, normal)], dim=-1)


def _turn(R: _Rot, v: _Vec) -> _Vec:
    return (R @ v[..., None])[..., 0]


def _unit(v: _Vec) -> _Vec:
    return torch.nn.functional.normalize(v, dim=-1)


def _perpendicular(v: _Vec, along: _Vec) -> _Vec:
    return _unit(v - (v * along).sum(-1, keepdim=True) * along)
