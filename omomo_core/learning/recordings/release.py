"""The OMOMO release's processed files: people with the objects they moved, on our skeleton.

The release's person is brought to our body's size with the whole scene: way, object and palms are
scaled by the length of the legs. Our arms are then solved to the release's palms, so that hands stay
where they were on the object.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import binary_closing, binary_opening

from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.body.rest_turns import rest_offsets, rest_turns
from omomo_core.errors import InputError
from omomo_core.geometry.surface import sample_surface
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import ground
from omomo_core.learning.recordings.release_sequences import ReleaseSequence, leg, read_release
from omomo_core.motion import ObjectMotion
from omomo_core.skeleton import joint

LICENCE = "OMOMO data (github.com/lijiaman/omomo_release): its authors state no licence"
_TOUCHING = 0.05
"""Metres between palm joint and surface: the paper's rule."""


def release_clips(
    path: Path, body: BodyModel, *, object_split: bool = False
) -> Iterator[Clip | InputError]:
    """Every sequence of a release file as a clip, or what is wrong with it.

    Args:
        path: as for `read_release`.
        body: whose proportions the clips get.
        object_split: as for `read_release`.

    Raises:
        InputError: as `read_release`.
    """
    for found in read_release(path, object_split=object_split):
        try:
            yield found if isinstance(found, InputError) else _clip(found, body)
        except InputError as problem:
            yield problem


def _clip(sequence: ReleaseSequence, body: BodyModel) -> Clip:
    ours = body.rest_joints.double().numpy()
    scale = leg(rest_offsets(body)) / leg(sequence.bones)
    theirs = sequence.joints() * scale
    R = sequence.rotations @ rest_turns(body, sequence.bones)
    hips = [joint("left_hip"), joint("right_hip")]
    root = theirs[:, hips].mean(axis=1) - R[:, 0] @ (ours[hips].mean(axis=0) - ours[0])
    grounded = ground(body, root, R)
    rotations = torch.from_numpy(grounded.rotations)
    for side, limb in enumerate(("left_arm", "right_arm")):
        goal = torch.from_numpy(theirs[:, 22 + side])
        rotations, _ = reach(body, torch.from_numpy(grounded.root), rotations, limb, goal)
    moved = sequence.moved(scale)
    return Clip(
        name=sequence.name,
        source="omomo",
        licence=LICENCE,
        root=grounded.root,
        rotations=rotations.numpy(),
        hand_contact=_touching(theirs[:, 22:], moved, _TOUCHING * scale),
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
