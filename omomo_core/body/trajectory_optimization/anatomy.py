"""Anatomy for the solver: turning bones, collision spheres, masses and joint ranges."""

from dataclasses import asdict, dataclass
from functools import lru_cache

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.kinematics import MODEL_REST
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.collision_spheres import (
    COARSE_SPHERES,
    DENSE_SPHERES,
    STATURE,
)
from omomo_core.body.trajectory_optimization.config import BODY_MASS, JOINT_RANGES, AxisRanges
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
    turning = _turning(above, offsets)
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


def _turning(above: list[int], offsets: Float[Tensor, "vectors 3"]) -> Float[Tensor, "entries c"]:
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
