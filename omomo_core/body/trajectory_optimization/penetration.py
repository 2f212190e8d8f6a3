"""Penetration depth of a body in an object, by the solver's collision spheres."""

from jaxtyping import Float
from torch import Tensor

from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.anatomy import build_anatomy
from omomo_core.body.trajectory_optimization.obstacle import Obstacle
from omomo_core.body.trajectory_optimization.residuals import anatomy_points


def penetration_depth(
    body: BodyModel,
    root: Float[Tensor, "*b frames 3"],
    rotations: Float[Tensor, "*b frames 22 3 3"],
    T_world_object: Float[Tensor, "frames 4 4"],
    obstacle: Obstacle,
) -> Float[Tensor, "*b frames"]:
    """Return the depth of the deepest sphere of trunk, arms and legs, metres; 0 where none is inside.

    Args:
        body: whose bones.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
        T_world_object: pose of the object.
        obstacle: the object.
    """
    anatomy = build_anatomy(body, clearance=0.0)
    points, _ = anatomy_points(
        anatomy, root.float().flatten(0, -2), rotations.float().flatten(0, -4)
    )
    balls, T = points[:, 5:].view(*root.shape[:-1], -1, 3), T_world_object.float()
    local = (balls - T[:, None, :3, 3]) @ T[:, :3, :3]
    depth, _ = obstacle.depth(local.flatten(0, -3), anatomy.radii)
    return depth.clamp(min=0).amax(dim=-1).view(root.shape[:-1])
