"""One motion to compare, whatever file it came from."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from omomo_core.body.model import BodyModel
from omomo_core.motion import HumanMotion, ObjectMotion


@dataclass(frozen=True)
class Motion:
    """A person and the object they move, at 30 fps."""

    label: str
    human: HumanMotion
    object_motion: ObjectMotion
    body: BodyModel
    contact: Bool[np.ndarray, "frames 2"]
    """When the left, right hand holds, as the result says or the clip's palms are near enough."""
    truth: bool = False
    """A recorded person."""


def moved(motion: Motion, T: Float[np.ndarray, "4 4"]) -> Motion:
    """The same motion elsewhere in the world; T turns about the vertical and shifts."""
    if np.array_equal(T, np.eye(4)):
        return motion
    R, t = T[:3, :3], T[:3, 3]
    human, thing = motion.human, motion.object_motion
    return replace(
        motion,
        human=replace(
            human,
            root=human.root @ R.T + t,
            rotations=R @ human.rotations,
            joints=human.joints @ R.T + t,
        ),
        object_motion=replace(thing, T_world_object=T @ thing.T_world_object),
    )


def stretch(motion: Motion, start: int, stop: int) -> Motion:
    """Frames `start` .. `stop` of a motion."""
    human, thing, part = motion.human, motion.object_motion, slice(start, stop)
    return replace(
        motion,
        human=HumanMotion(**{k: getattr(human, k)[part] for k in HumanMotion.__dataclass_fields__}),
        object_motion=replace(
            thing,
            T_world_object=thing.T_world_object[part],
            valid=thing.valid[part],
            start_time=thing.start_time,
        ),
        contact=motion.contact[part],
    )
