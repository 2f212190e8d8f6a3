"""Hands of solved bodies laid on what they hold: turned, raised, and the arms solved again."""

from collections.abc import Sequence
from dataclasses import replace

import roma
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import WRISTS, forward_kinematics
from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.targets import InteractionTargets
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.collision.root import ELBOWS
from omomo_core.generation.solving.bodies import SolvedBodies
from omomo_core.generation.solving.config import BODY_SOLVING
from omomo_core.generation.solving.palm_clearance import raise_palms
from omomo_core.generation.solving.palm_plan import find_holds, share_twist, turn_palms
from omomo_core.generation.solving.reach import ARMS
from omomo_core.skeleton import PALM_JOINTS


def lay_palms(
    body: BodyModel,
    solved: SolvedBodies,
    targets: InteractionTargets,
    segments: Sequence[tuple[ContactSegment, ...]],
    free: Float[Tensor, " frames"],
) -> SolvedBodies:
    """Return bodies whose palms lie on what they hold, wrists within their range.

    Args:
        body: whose hands.
        solved: palms on their targets.
        targets: what they are solved for.
        segments: what each hand holds and when.
        free: how far each frame may be changed, from 0 to 1.
    """
    if not any(segments):
        return solved
    root, rotations = solved.root, solved.rotations.clone()
    field, T = targets.obstacle.field, targets.T_world_object
    joints = forward_kinematics(body, root, rotations).float()
    palms = joints[..., 22:, :]
    for k, held in enumerate(segments):
        holds = list(find_holds(joints[k], rotations[k].float(), held, T, field, free))
        turn = turn_palms(body, rotations[k][:, WRISTS].float(), holds, T, field)
        wrists = roma.rotvec_to_rotmat(free[:, None, None] * turn) @ rotations[k][:, WRISTS]
        at = palms[k] - (wrists.float() @ _hands(body)[..., None])[..., 0]
        rise = raise_palms(body, at, wrists.float(), holds, T, field)
        palms[k] += free[:, None, None] * rise
        rotations[k][:, WRISTS] = wrists
    for side in range(2):
        goal = palms[..., side, :].to(rotations)
        rotations, _ = reach(body, root, rotations, ARMS[side], goal, gently=True)
    twist = roma.rotmat_to_rotvec(share_twist(rotations[:, :, ELBOWS], rotations[:, :, WRISTS]))
    rotations[:, :, ELBOWS] = rotations[:, :, ELBOWS] @ roma.rotvec_to_rotmat(
        free[:, None, None] * twist
    )
    fixed = (free == 0)[:, None, None, None]
    rotations = torch.where(fixed, solved.rotations, rotations)
    miss = (forward_kinematics(body, root, rotations)[..., 22:, :] - targets.palms).norm(dim=-1)
    held = targets.hold > BODY_SOLVING.full_hold
    return replace(solved, rotations=rotations, miss=torch.where(held, miss, 0.0))


def _hands(body: BodyModel) -> Float[Tensor, "2 3"]:
    """Return the way from each wrist to its palm joint, at rest, metres."""
    rest = body.rest_joints.float()
    return rest[list(PALM_JOINTS)] - rest[list(WRISTS)]
