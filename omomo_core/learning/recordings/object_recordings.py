"""Recordings of people together with the object they hold, and the clips they become on our skeleton.

The whole scene (way, object, palms) is scaled to our legs. Then our arms are solved to the recorded palms,
so that hands stay where they were on the object.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float

from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import runs
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import ground
from omomo_core.learning.recordings.mocap import SourceMotion
from omomo_core.learning.recordings.retargeting import SHORTEST, WORST_SKATING, usable_frames
from omomo_core.learning.recordings.smpl import RecordedMotion
from omomo_core.motion import ObjectMesh, ObjectMotion

LEAST_CONTACT = 10
"""Frames of contact without which a stretch says nothing about holding."""


@dataclass(frozen=True)
class RecordedObject:
    """An object and the hands on it, as large as they were recorded; world z up, floor 0, 30 fps."""

    mesh: ObjectMesh
    T_world_object: Float[np.ndarray, "frames 4 4"]
    palms: Float[np.ndarray, "frames 2 3"]
    """Where the bases of the middle fingers must be, left and right, metres."""
    contact: Bool[np.ndarray, "frames 2"]
    """Whether the left, right hand touches the object."""
    usable: Bool[np.ndarray, " frames"]
    """False where no hand moves the object that moves."""


@dataclass(frozen=True)
class ObjectRecording:
    """A recording on a skeleton of its own, and the object in it."""

    motion: SourceMotion
    held: RecordedObject


def object_clips(
    person: RecordedMotion,
    held: RecordedObject,
    scale: float,
    body: BodyModel,
    dropped: Counter[str] | None = None,
) -> Iterator[Clip]:
    """Yield the stretches in which the person stands and the object rests or is held.

    Args:
        person: on our skeleton, scaled to our legs.
        held: as recorded.
        scale: our legs to theirs.
        body: whose proportions the clips get.
        dropped: counts recordings that skate (``skating``) or in which no stretch of 0.8 s shows a
            hand on the object (``no-contact``).
    """
    grounded = ground(body, person.root, person.rotations)
    if grounded.skating > WORST_SKATING:
        if dropped is not None:
            dropped["skating"] += 1
        return
    palms = torch.from_numpy(held.palms * scale)
    rotations = torch.from_numpy(grounded.rotations)
    for side, limb in enumerate(("left_arm", "right_arm")):
        rotations, _ = reach(body, torch.from_numpy(grounded.root), rotations, limb, palms[:, side])
    T = held.T_world_object.copy()
    T[:, :3, 3] *= scale
    mesh = ObjectMesh(
        (held.mesh.vertices * scale).astype(np.float32), held.mesh.faces, held.mesh.name
    )
    stretches = _stretches(held, usable_frames(body, grounded))
    if not stretches and dropped is not None:
        dropped["no-contact"] += 1
    for k, part in enumerate(stretches):
        yield Clip(
            name=person.name if len(stretches) == 1 else f"{person.name}#{k}",
            source=person.source,
            licence=person.licence,
            root=grounded.root[part],
            rotations=rotations.numpy()[part],
            hand_contact=held.contact[part].astype(float),
            foot_contact=grounded.foot_contact[part],
            object_motion=ObjectMotion(mesh, T[part], np.ones(len(T[part]), bool)),
        )


def _stretches(held: RecordedObject, standing: Bool[np.ndarray, " frames"]) -> list[slice]:
    found = [slice(a, b) for a, b in runs(held.usable & standing) if b - a >= SHORTEST]
    return [part for part in found if held.contact[part].any(axis=1).sum() >= LEAST_CONTACT]
