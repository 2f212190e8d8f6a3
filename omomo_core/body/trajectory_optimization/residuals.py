"""Residuals of a pose, weighted, with their derivatives in the bones' turns."""

import roma
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.trajectory_optimization.anatomy import BONES, LIMITS, VALUES, Anatomy
from omomo_core.body.trajectory_optimization.config import RESIDUALS
from omomo_core.body.trajectory_optimization.targets import FrameTargets
from omomo_core.skeleton import joint

_PARENT_JOINTS = [joint(parent) for parent, _, _ in LIMITS]
_CHILD_JOINTS = [joint(child) for _, child, _ in LIMITS]
_WRISTS = [joint("left_wrist"), joint("right_wrist")]
_RANGES = torch.tensor([ranges for *_, ranges in LIMITS])


_Rows = tuple[Float[Tensor, "times rows values"], Float[Tensor, "times rows"]]
_Normals = tuple[list[int], Float[Tensor, "times rows 3"], Float[Tensor, "times rows"]]
"""Point of each row, gradient of its residual in the point, and the residual."""


def directions() -> Float[Tensor, "directions 3"]:
    """Return horizontal unit vectors all around."""
    angle = torch.arange(RESIDUALS.support_directions) * (
        2 * torch.pi / RESIDUALS.support_directions
    )
    return torch.stack(
        [angle.cos(), angle.sin(), torch.zeros(RESIDUALS.support_directions)], dim=-1
    )


def support_extent(
    soles: Float[Tensor, "times 4 3"],
    planted: Float[Tensor, "times 4"],
    centre: Float[Tensor, "times 3"],
) -> Float[Tensor, "times directions"]:
    """Return how far the feet support the body in each direction, metres; anywhere when in the air.

    Args:
        soles: heels and balls of the feet.
        planted: which of them stand.
        centre: of mass, of a recording: there it did not fall over.
    """
    reach = soles @ directions().T.to(soles)
    reach = (
        reach.masked_fill(planted[..., None] == 0, -torch.inf).amax(dim=1) + RESIDUALS.foot_support
    )
    reach = torch.maximum(reach, centre @ directions().T)
    return torch.where(planted.any(dim=1, keepdim=True), reach, RESIDUALS.support_in_air)


def anatomy_points(
    anatomy: Anatomy, root: Float[Tensor, "times 3"], rotations: Float[Tensor, "times 22 3 3"]
) -> tuple[Float[Tensor, "times points 3"], Float[Tensor, "times vectors 3"]]:
    """Return the points of the anatomy and the vectors they are made of, world, metres."""
    entries = rotations.flatten(1)
    points, vectors = (
        (entries @ how).unflatten(1, (-1, 3)) for how in (anatomy.spanning, anatomy.turning)
    )
    return root[:, None] + points, vectors


def linearise(
    anatomy: Anatomy,
    targets: FrameTargets,
    root: Float[Tensor, "times 3"],
    rotations: Float[Tensor, "times 22 3 3"],
) -> _Rows:
    """Return Jacobian and residuals of all terms but closeness and smoothness.

    Collision spheres and joint ranges that cost nothing at any time have no rows.
    """
    points, bones = anatomy_points(anatomy, root, rotations)
    terms = (
        _reaching(targets, points),
        _colliding(anatomy, targets, points),
        _balancing(anatomy, targets, points),
    )
    normals = torch.cat([normal for _, normal, _ in terms], dim=1)
    errors = torch.cat([error for _, _, error in terms], dim=1)
    which = [point for points, _, _ in terms for point in points]
    moving = sorted(set(which))
    shares = anatomy.levers[moving].flatten(0, 1)
    levers = (shares @ bones.transpose(0, 1).flatten(1)).view(len(moving), -1, len(root), 3)
    levers = levers[[moving.index(point) for point in which]].permute(2, 0, 1, 3)
    turning = torch.linalg.cross(levers, normals[:, :, None], dim=-1)
    position = torch.cat([normals[:, :, None], turning], dim=2).flatten(2)
    angular, off = _turning(targets, rotations)
    return torch.cat([position, angular], dim=1), torch.cat([errors, off], dim=1)


def _reaching(targets: FrameTargets, points: Float[Tensor, "times points 3"]) -> _Normals:
    """Return the residuals of palms and ankles from their targets."""
    weight = torch.cat(
        [
            RESIDUALS.palm * targets.hold,
            RESIDUALS.swinging_ankle
            + (RESIDUALS.planted_ankle - RESIDUALS.swinging_ankle) * targets.planted,
        ],
        dim=1,
    )
    error = (points[:, :4] - torch.cat([targets.palms, targets.ankles], dim=1)) * weight[..., None]
    normals = weight[..., None, None] * torch.eye(3)
    return [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3], normals.flatten(1, 2), error.flatten(1)


def _colliding(
    anatomy: Anatomy, targets: FrameTargets, points: Float[Tensor, "times points 3"]
) -> _Normals:
    """Return the residuals of collision spheres inside the object."""
    R, at = targets.T_world_object[:, :3, :3], targets.T_world_object[:, :3, 3]
    local = (points[:, 5:] - at[:, None]) @ R
    depth, normal = targets.obstacle.depth(local, anatomy.radii)
    hit = (depth > 0).any(dim=0).nonzero()[:, 0]
    touching = RESIDUALS.penetration * (depth[:, hit] > 0)
    away = -touching[..., None] * (normal[:, hit] @ R.mT)
    return (5 + hit).tolist(), away, touching * depth[:, hit]


def _balancing(
    anatomy: Anatomy, targets: FrameTargets, points: Float[Tensor, "times points 3"]
) -> _Normals:
    """Return the residual of the centre of mass beside the feet, in the direction of the largest excess."""
    weight, normal = overbalance(anatomy, targets, points[:, 4])
    share = anatomy.mass / (anatomy.mass + targets.carried_mass)
    strong = (RESIDUALS.balance * targets.balance * (weight > 0))[:, None]
    return [4], (strong * share[:, None] * normal)[:, None], strong * weight[:, None]


def overbalance(
    anatomy: Anatomy, targets: FrameTargets, centre: Float[Tensor, "times 3"]
) -> tuple[Float[Tensor, " times"], Float[Tensor, "times 3"]]:
    """Return how far the loaded centre of mass is outside the support, metres, and in which direction."""
    total = anatomy.mass + targets.carried_mass
    loaded = (anatomy.mass * centre + targets.carried_moment) / total[:, None]
    out, side = (loaded @ directions().T - targets.support).max(dim=-1)
    return out, directions()[side]


def _turning(targets: FrameTargets, rotations: Float[Tensor, "times 22 3 3"]) -> _Rows:
    """Return the residuals of joints outside their ranges, and of wrists from their targets."""
    inverse = rotations[:, _PARENT_JOINTS].mT
    turned = inverse @ rotations[:, _CHILD_JOINTS]
    grasped = rotations[:, _WRISTS] @ targets.R_world_wrist.mT
    found = roma.rotmat_to_rotvec(torch.cat([turned, grasped], dim=1))
    angles, off = found.split([len(LIMITS), 2], dim=1)
    beyond = angles - angles.clamp(_RANGES[..., 0], _RANGES[..., 1])
    stopped = (beyond != 0).any(dim=2).any(dim=0).nonzero()[:, 0].tolist()
    axes = inverse * (RESIDUALS.joint_range * (beyond != 0))[..., None]
    weight = (RESIDUALS.wrist * targets.hold)[..., None]
    J = axes.new_zeros(len(axes), len(stopped) + 2, 3, VALUES)
    for row, k in enumerate(stopped):
        parent, child, _ = LIMITS[k]
        J[:, row, :, _columns(child)] = axes[:, k]
        J[:, row, :, _columns(parent)] = -axes[:, k]
    for k, bone in enumerate(("left_wrist", "right_wrist")):
        J[:, len(stopped) + k, :, _columns(bone)] = weight[:, k, None] * torch.eye(3)
    return J.flatten(1, 2), torch.cat(
        [RESIDUALS.joint_range * beyond[:, stopped], weight * off], dim=1
    ).flatten(1)


def _columns(bone: str) -> slice:
    first = 3 + 3 * BONES.index(bone)
    return slice(first, first + 3)
