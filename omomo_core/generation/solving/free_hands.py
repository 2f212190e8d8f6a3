"""Hands that hold nothing are led out of the person's own thighs and hips.

Sampled arms hang nearer to the body than people's do, and networks know no flesh: in a fourth of their free
frames fingers are within 7 cm of a thigh's bone, where people's are in one of a thousand.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d
from torch import Tensor

from omomo_core.body.kinematics import WRISTS, forward_kinematics, full_kinematics
from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.generation.solving.palm_plan import ARMS
from omomo_core.generation.solving.solving_config import FREE_HANDS
from omomo_core.skeleton import joint

_LEGS = (("left_hip", "left_knee"), ("right_hip", "right_knee"), ("left_hip", "right_hip"))
"""Bones that the flesh lies around: both thighs, then the hips."""


@dataclass(frozen=True)
class Flesh:
    """Capsules around bones."""

    start: Float[Tensor, "*b 3 3"]
    """One end of each bone, world, metres."""
    way: Float[Tensor, "*b 3 3"]
    """From there to its other end."""
    radius: Float[Tensor, "3"]
    """Distance of a finger joint from the bone at which skin touches skin, metres."""

    @staticmethod
    def of(joints: Float[Tensor, "*b 24 3"]) -> "Flesh":
        """Return thighs and hips of a body in each frame."""
        ends = [[joint(name) for name in pair] for pair in _LEGS]
        start, stop = (joints[..., [pair[k] for pair in ends], :] for k in range(2))
        radius = joints.new_tensor([FREE_HANDS.thigh, FREE_HANDS.thigh, FREE_HANDS.hips])
        return Flesh(start, stop - start, radius)

    def way_out(
        self, points: Float[Tensor, "*b points 3"], outward: Float[Tensor, "*b 3"]
    ) -> Float[Tensor, "*b 3"]:
        """Return the shift that brings the deepest point to the skin, metres; 0 where none is inside.

        Args:
            points: of a hand, world, metres.
            outward: unit vector to the person's side: there goes a hand that is in the middle of a thigh, in
                all frames in which it passes through.
        """
        from_start = points[..., :, None, :] - self.start[..., None, :, :]
        way = self.way[..., None, :, :]
        along = ((from_start * way).sum(-1) / (way**2).sum(-1)).clamp(0, 1)
        off = (from_start - along[..., None] * way).flatten(-3, -2)
        radius = self.radius.expand(along.shape).flatten(-2)
        deepest = (radius - off.norm(dim=-1)).argmax(dim=-1, keepdim=True)
        off = torch.take_along_dim(off, deepest[..., None], dim=-2)[..., 0, :]
        radius = torch.take_along_dim(radius, deepest, dim=-1)
        out = torch.nn.functional.normalize(off + FREE_HANDS.sideways * outward, dim=-1)
        # The point leaves along `out` where it is `radius` from the bone.
        along = (off * out).sum(-1, keepdim=True)
        room = (radius**2 - (off**2).sum(-1, keepdim=True)).clamp(min=0)
        return out * ((along**2 + room).sqrt() - along)


def lead_hands_out(
    body: BodyModel,
    root: Float[Tensor, "*b 3"],
    rotations: Float[Tensor, "*b 22 3 3"],
    hold: Float[Tensor, "*b 2"],
    free: Float[Tensor, " frames"],
) -> Float[Tensor, "*b 22 3 3"]:
    """Return rotations with shoulders and elbows turned so that free hands are outside thighs and hips.

    Args:
        body: whose bones and hands.
        root: pelvis joint, world, metres; frames are the last axis of the batch.
        rotations: global R_world_joint.
        hold: how far each arm follows what its palm holds, in [0, 1]; such a hand stays where it is.
        free: how far each frame may be changed, in [0, 1].
    """
    hand = _hand_points(body).to(rotations)
    may = (1 - hold.to(rotations)) * free.to(rotations)[:, None]
    for _ in range(FREE_HANDS.rounds):
        joints = forward_kinematics(body, root, rotations)
        flesh = Flesh.of(joints)
        R = rotations[..., WRISTS, :, :]
        points = joints[..., WRISTS, None, :] + (R[..., None, :, :] @ hand[..., None])[..., 0]
        left = rotations[..., 0, :, 0]
        shifts = [
            may[..., k, None] * flesh.way_out(points[..., k, :, :], outward)
            for k, outward in enumerate((left, -left))
        ]
        if not any((shift != 0).any() for shift in shifts):
            break
        for k, shift in enumerate(shifts):
            if (shift == 0).all():
                continue
            shift = _steady(shift) * (may[..., k, None] > 0)
            # What is hardly moved is hardly solved: arms that hang straight stay so.
            weight = (shift.norm(dim=-1) / FREE_HANDS.solved_from).clamp(max=1)
            goal = joints[..., 22 + k, :] + shift
            rotations, _ = reach(body, root, rotations, ARMS[k], goal, weight=weight, gently=True)
    return rotations


def _hand_points(body: BodyModel) -> Float[Tensor, "2 15 3"]:
    """Return the finger joints of relaxed hands from their wrist, in the wrist's axes, metres."""
    rest = torch.eye(3).expand(22, 3, 3).to(body.rest_joints)
    root = body.rest_joints.new_zeros(3)
    joints, _ = full_kinematics(body, root, rest, body.relaxed_fingers.to(rest))
    return torch.stack([joints[22 + 15 * k : 37 + 15 * k] - joints[WRISTS[k]] for k in range(2)])


def _steady(shift: Float[Tensor, "*b frames 3"]) -> Float[Tensor, "*b frames 3"]:
    """Return a shift that comes and goes slowly and is nowhere much shorter."""
    wide = gaussian_filter1d(shift.numpy(), FREE_HANDS.smoothing, axis=-2, mode="nearest")
    return torch.from_numpy(np.asarray(wide)).to(shift)
