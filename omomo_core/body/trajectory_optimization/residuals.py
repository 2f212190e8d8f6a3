"""Residuals of the trajectory optimization: anatomy, targets, speeds and penetration.

The three share their names: `palms` and `R_world_wrist` say where hands go, `hold` how firmly, `obstacle`
what the body stays out of, `balance` where the weight must be over the feet.
"""

from dataclasses import asdict, dataclass, fields, replace
from functools import lru_cache

import numpy as np
import roma
import torch
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor

from omomo_core.body.kinematics import MODEL_REST
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.obstacle import (
    COARSE_SPHERES,
    DENSE_SPHERES,
    STATURE,
    MeshObstacle,
    Obstacle,
)
from omomo_core.body.trajectory_optimization.solver_config import (
    ARM_SPEED,
    BODY_MASS,
    JOINT_RANGES,
    RESIDUALS,
    AxisRanges,
)
from omomo_core.geometry.transforms import nearest_rotation, turning_speed
from omomo_core.motion import FPS
from omomo_core.skeleton import BODY_JOINTS, MODEL_ABOVE, MODEL_PARENTS, joint

_SIDES = ("left", "right")
BONES = ("pelvis", "spine3", *(f"{s}_{n}" for n in ("collar", "shoulder", "elbow", "wrist", "hip",
                                                    "knee") for s in _SIDES))  # fmt: skip
"""Bones that turn on their own; feet keep their orientation."""
PARENT_BONES: dict[str, str] = {
    "spine3": "pelvis",
    **{f"{s}_{bone}": parent for s in _SIDES for bone, parent in (("collar", "spine3"), ("hip", "pelvis"))},
    **{f"{s}_{bone}": f"{s}_{parent}" for s in _SIDES for bone, parent in
       (("shoulder", "collar"), ("elbow", "shoulder"), ("wrist", "elbow"), ("knee", "hip"))},
}  # fmt: skip
"""The bone from which each bone but the pelvis hangs."""
_BETWEEN: dict[str, dict[str, float]] = {
    "spine1": {"pelvis": 2 / 3, "spine3": 1 / 3},
    "spine2": {"pelvis": 1 / 3, "spine3": 2 / 3},
    "neck": {"spine3": 0.75},
    "head": {"spine3": 0.5},
}
"""Joints that turn with those bones: the spine bends evenly, and the head half keeps its direction."""
VALUES = 3 * (1 + len(BONES))
"""Per frame: a shift of the pelvis and one rotation vector per bone."""

_MASSES: tuple[tuple[str, str, float, float], ...] = (
    ("neck", "head", 1.0, 0.0694 + 0.0127), ("neck", "spine2", 0.45, 0.30),
    ("spine2", "pelvis", 0.6, 0.1346),
    *(row for s in _SIDES for row in (
        (f"{s}_shoulder", f"{s}_elbow", 0.577, 0.0271), (f"{s}_elbow", f"{s}_wrist", 0.457, 0.0162),
        (f"{s}_wrist", f"{s}_wrist", 0.0, 0.0061), (f"{s}_hip", f"{s}_knee", 0.41, 0.1416),
        (f"{s}_knee", f"{s}_ankle", 0.446, 0.0433), (f"{s}_ankle", f"{s}_foot", 0.44, 0.0137),
    )),
)  # fmt: skip
"""Segments: from, to, share of the way to the centre of mass, share of the weight (de Leva 1996)."""

LIMITS: tuple[tuple[str, str, AxisRanges], ...] = tuple(
    (PARENT_BONES[child], child, ranges) for child, ranges in asdict(JOINT_RANGES).items()
)
"""Parent, child, and range of the rotation vector from parent to child about rest x, y, z, radians."""


@dataclass(frozen=True)
class Anatomy:
    """Points of one body that are linear in its bones, with how turning bones moves them."""

    follows: Float[Tensor, "points 24"]
    """Share of each joint in each point."""
    placing: Float[Tensor, "points vectors"]
    """Share of each vector in each point: bones of the tree, then the offsets from bones to spheres."""
    levers: Float[Tensor, "points bones vectors"]
    """Share of each vector in the lever with which a turning bone moves a point."""
    turning: Float[Tensor, "entries components"]
    """How the 22 x 9 entries of the joints' rotations make up the vectors."""
    spanning: Float[Tensor, "entries coordinates"]
    """How they make up the points, from the pelvis."""
    mixing: Float[Tensor, "22 bones"]
    """How the body's joints turn with the bones."""
    radii: Float[Tensor, " flesh"]
    mass: float
    """Kilograms."""


@lru_cache(maxsize=4)
def build_anatomy(body: BodyModel, *, clearance: float | None = None) -> Anatomy:
    """Return the points of a body: two palms, two ankles, the centre of mass, then collision spheres.

    Args:
        body: whose bones.
        clearance: metres added to the radii of the spheres that fill the body to its skin; None for the
            coarse spheres that the synthesis uses.
    """
    spheres = COARSE_SPHERES if clearance is None else DENSE_SPHERES
    size = body.height / STATURE
    rest = body.rest_joints[list(MODEL_REST)].float()
    above = list(MODEL_ABOVE)
    beside = torch.tensor([sphere.offset for sphere in spheres]) * size
    beside[[sphere.start == sphere.end == "head" for sphere in spheres]] += _to_skull(body)
    offsets = torch.cat([rest - rest[above], beside])
    above += [joint(sphere.start) for sphere in spheres]
    mixing = torch.zeros(22, len(BONES))
    for name in BODY_JOINTS:
        for bone, share in _BETWEEN.get(name, {name: 1.0} if name in BONES else {}).items():
            mixing[joint(name), BONES.index(bone)] = share
    follows = torch.zeros(5 + len(spheres), 24)
    for row, j in enumerate((22, 23, joint("left_ankle"), joint("right_ankle"))):
        follows[row, j] = 1.0
    follows[4] = _mass_shares()
    for row, sphere in enumerate(spheres, start=5):
        follows[row, joint(sphere.start)] += 1 - sphere.share
        follows[row, joint(sphere.end)] += sphere.share
    beyond = torch.cat([torch.zeros(5, len(spheres)), torch.eye(len(spheres))])
    placing = torch.cat([follows @ _tree(), beyond], dim=1)
    turning = _offset_matrix(above, offsets)
    return Anatomy(
        follows=follows,
        placing=placing,
        levers=placing[:, None, :] * mixing[above].T[None],
        turning=turning,
        spanning=(placing @ turning.unflatten(1, (-1, 3))).flatten(1),
        mixing=mixing,
        radii=torch.tensor([sphere.radius for sphere in spheres]) * size + (clearance or 0.0),
        mass=BODY_MASS.body_mass_index * body.height**2,
    )


def _to_skull(body: BodyModel) -> Float[Tensor, "3"]:
    """Return the vector from the head joint to the middle of the head's skin, at rest, metres.

    Skeletons have that joint at the nape or between the ears.
    """
    main = body.skin_joints.gather(1, body.skin_weights.argmax(dim=1, keepdim=True))[:, 0]
    skin = body.vertices[main == joint("head")]
    return ((skin.amin(dim=0) + skin.amax(dim=0)) / 2 - body.rest_joints[joint("head")]).float()


def centre_of_mass(joints: Float[np.ndarray, "*b 24 3"]) -> Float[np.ndarray, "*b 3"]:
    """Return the centre of mass of a pose, given its joints; metres."""
    return np.einsum("j,...jx->...x", _mass_shares().double().numpy(), joints)


def _offset_matrix(
    above: list[int], offsets: Float[Tensor, "vectors 3"]
) -> Float[Tensor, "entries c"]:
    """Return the matrix from the entries of all rotations to the offsets that they turn."""
    matrix = torch.zeros(22, 3, 3, len(above), 3)
    for row in range(3):
        matrix[above, row, :, range(len(above)), row] = offsets
    return matrix.flatten(3).flatten(0, 2)


def _mass_shares() -> Float[Tensor, " 24"]:
    shares = torch.zeros(24)
    for start, end, share, part in _MASSES:
        shares[joint(start)] += part * (1 - share)
        shares[joint(end)] += part * share
    return shares / shares.sum()


def _tree() -> Float[Tensor, "24 24"]:
    """Return a matrix with 1 where the second joint's bone lies between the pelvis and the first joint."""
    matrix = np.zeros((24, 24), np.float32)
    for j, parent in enumerate(MODEL_PARENTS):
        if parent >= 0:
            matrix[j] = matrix[parent]
            matrix[j, j] = 1.0
    return torch.as_tensor(matrix)


@dataclass(frozen=True)
class InteractionTargets:
    """Targets of the hands of K samples on a mesh, and the mesh as an obstacle; single precision."""

    palms: Float[Tensor, "samples frames 2 3"]
    """Left and right palm, world, metres."""
    hold: Float[Tensor, "samples frames 2"]
    """How strongly each palm must be there, in [0, 1]."""
    R_world_wrist: Float[Tensor, "samples frames 2 3 3"]
    """How a holding hand should be turned."""
    T_world_object: Float[np.ndarray, "frames 4 4"]
    obstacle: MeshObstacle
    """What the body must stay out of."""
    balance: Float[np.ndarray, " frames"]
    """1 where the weight must be over the feet, 0 where the object may be leant on."""


@dataclass(frozen=True)
class SolverTargets:
    """Targets of one clip or of several with the same object: hands, feet, obstacle and carried mass."""

    palms: Float[np.ndarray, "*b frames 2 3"]
    """Left and right palm, world, metres."""
    R_world_wrist: Float[np.ndarray, "*b frames 2 3 3"]
    hold: Float[np.ndarray, "*b frames 2"]
    """0 where a hand is free, 1 where it holds, smooth between."""
    ankles: Float[np.ndarray, "*b frames 2 3"]
    """Ankles of the initial motion, world, metres."""
    soles: Float[np.ndarray, "*b frames 4 3"]
    """Left heel, right heel, left ball, right ball, world, metres."""
    planted: Bool[np.ndarray, "*b frames 4"]
    """Which of the soles stand."""
    centre: Float[np.ndarray, "*b frames 3"]
    """Centre of mass of the initial motion, which counts as balanced wherever its feet seem to be."""
    T_world_object: Float[np.ndarray, "frames 4 4"]
    obstacle: Obstacle
    """What the body must stay out of."""
    balance: Float[np.ndarray, " frames"]
    """1 where the weight must be over the feet, 0 where the object may be leant on."""
    carried_mass: float
    """Mass of the object while it is carried, kilograms; 0 where it stands on its own."""

    def select(self, clips: slice) -> "SolverTargets":
        """Return the targets of some of several clips."""
        shared = ("T_world_object", "obstacle", "balance", "carried_mass")
        own = (f.name for f in fields(self) if f.name not in shared)
        return replace(self, **{name: getattr(self, name)[clips] for name in own})


@dataclass(frozen=True)
class FrameTargets:
    """Targets at the frames that are evaluated, of all clips one after another; single precision."""

    palms: Float[Tensor, "times 2 3"]
    R_world_wrist: Float[Tensor, "times 2 3 3"]
    hold: Float[Tensor, "times 2"]
    ankles: Float[Tensor, "times 2 3"]
    planted: Float[Tensor, "times 2"]
    """How firmly each foot stands, in [0, 1]."""
    support: Float[Tensor, "times directions"]
    """How far the feet support in each horizontal direction, world, metres."""
    balance: Float[Tensor, " times"]
    carried_moment: Float[Tensor, "times 3"]
    """Mass times position of the object where it is carried, kilogram metres."""
    carried_mass: Float[Tensor, " times"]
    T_world_object: Float[Tensor, "times 4 4"]
    obstacle: Obstacle


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
    angular, off = _joint_range_rows(targets, rotations)
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


def _joint_range_rows(targets: FrameTargets, rotations: Float[Tensor, "times 22 3 3"]) -> _Rows:
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


_CHEST = joint("spine3")
_ARMS = tuple(joint(f"{side}_{name}") for name in ("shoulder", "elbow") for side in
              ("left", "right"))  # fmt: skip


def limit_arm_speed(
    rotations: Float[np.ndarray, "frames 22 3 3"],
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Return rotations in which the quickest turns of shoulders and elbows are spread over time.

    Blending a recorded arm into one that holds can turn the upper arm about itself in an instant.
    Palms move a little, and have to be solved again.
    """
    out = rotations.copy()
    chest = rotations[:, _CHEST]
    for j in _ARMS:
        local = np.swapaxes(chest, -1, -2) @ rotations[:, j]
        for _ in range(ARM_SPEED.rounds):
            quick = turning_speed(local, FPS) > ARM_SPEED.fastest
            if not quick.any():
                break
            local = _spread(local, quick)
            out[:, j] = chest @ local
    return out


def _spread(
    R: Float[np.ndarray, "frames 3 3"], quick: Bool[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames 3 3"]:
    near = maximum_filter1d(quick.astype(float), round(4 * ARM_SPEED.width))
    weight = gaussian_filter1d(near, ARM_SPEED.width, mode="nearest")[:, None, None]
    mean = gaussian_filter1d(R, ARM_SPEED.width, axis=0, mode="nearest")
    return nearest_rotation((1 - weight) * R + weight * mean)


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
