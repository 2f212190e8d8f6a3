"""A person on SMPL-X's skeleton with bones of their own, who holds an object: to a clip of our size.

The person is brought to our body's size with the whole scene: way, object and palms are scaled by the
length of the legs. Our arms are then solved to the person's palms, so that hands stay where they were on
the object.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import binary_closing, binary_opening

from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.body.rest_turns import rest_offsets, rest_turns
from omomo_core.geometry.surface import sample_surface
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import ground
from omomo_core.motion import ObjectMotion
from omomo_core.skeleton import MODEL_PARENTS, joint

_TOUCHING = 0.05
"""Metres between palm joint and surface: the paper's rule."""


@dataclass(frozen=True)
class SmplPerson:
    """How a person with bones of their own moves; world z up, floor 0, metres, 30 fps."""

    pelvis: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    """Global, the identity is SMPL-X's rest pose (x left, y up, z forward)."""
    bones: Float[np.ndarray, "24 3"]
    """From each joint's parent to it at rest; the root's own row means nothing."""

    def joints(self) -> Float[np.ndarray, "frames 24 3"]:
        """The 22 body joints and two palms, world, metres."""
        joints = [self.pelvis]
        for j in range(1, 24):
            parent = MODEL_PARENTS[j]
            joints.append(joints[parent] + self.rotations[:, parent] @ self.bones[j])
        return np.stack(joints, axis=1)


@dataclass(frozen=True)
class ClipOrigin:
    """What a clip says of itself."""

    name: str
    source: str
    licence: str


def leg(bones: Float[np.ndarray, "24 3"]) -> float:
    """Length of thigh and shin, mean of both sides."""
    names = [f"{side}_{part}" for side in ("left", "right") for part in ("knee", "ankle")]
    return float(np.linalg.norm(bones[[joint(n) for n in names]], axis=-1).sum()) / 2


def size_of(person: SmplPerson, body: BodyModel) -> float:
    """How many times as large the person's scene must become for our legs."""
    return leg(rest_offsets(body)) / leg(person.bones)


def person_root(
    person: SmplPerson, body: BodyModel
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Root and global rotations of our body, at the scene's new size and not yet on the floor."""
    ours = body.rest_joints.double().numpy()
    theirs = person.joints() * size_of(person, body)
    R = person.rotations @ rest_turns(body, person.bones)
    hips = [joint("left_hip"), joint("right_hip")]
    root = theirs[:, hips].mean(axis=1) - R[:, 0] @ (ours[hips].mean(axis=0) - ours[0])
    return root, R


def person_clip(
    person: SmplPerson, moved: ObjectMotion, origin: ClipOrigin, body: BodyModel
) -> Clip:
    """A person and the object they hold on our body.

    Args:
        person: at their own size.
        moved: the object, `size_of` the person times as large as it was.
        origin: name, source and licence of the clip.
        body: whose proportions the clip gets.
    """
    scale = size_of(person, body)
    palms = person.joints()[:, 22:] * scale
    root, R = person_root(person, body)
    grounded = ground(body, root, R)
    rotations = torch.from_numpy(grounded.rotations)
    for side, limb in enumerate(("left_arm", "right_arm")):
        goal = torch.from_numpy(palms[:, side])
        rotations, _ = reach(body, torch.from_numpy(grounded.root), rotations, limb, goal)
    return Clip(
        name=origin.name,
        source=origin.source,
        licence=origin.licence,
        root=grounded.root,
        rotations=rotations.numpy(),
        hand_contact=_touching(palms, moved, _TOUCHING * scale),
        foot_contact=grounded.foot_contact,
        object_motion=moved,
    )


def _touching(
    palms: Float[np.ndarray, "frames 2 3"], moved: ObjectMotion, near: float
) -> Float[np.ndarray, "frames 2"]:
    """1 where a palm is nearer to the surface than `near`, without flicker."""
    T = moved.T_world_object
    local = np.einsum("tji,tkj->tki", T[:, :3, :3], palms - T[:, None, :3, 3])
    distance, _ = sample_surface(moved.mesh).tree.query(local.reshape(-1, 3))
    column = np.ones((5, 1), bool)
    touching = distance.reshape(-1, 2) < near
    return binary_opening(binary_closing(touching, column), column).astype(float)
