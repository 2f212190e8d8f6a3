"""The published generator: one window of four seconds, no release, nothing solved afterwards.

Its networks see the object in the frame of the person in the first frame, which no phone knows. So each
sample stands at another place around the object, and the ranking chooses.
"""

import numpy as np
import torch
from jaxtyping import Float

from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.penetration import penetration_depth
from omomo_core.contact.decode import decode
from omomo_core.contact.segment import follow_anchors
from omomo_core.errors import InputError
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import Person
from omomo_core.generation.result import Generation, GenerationOptions, Progress
from omomo_core.generation.sampling.paper import bodies_from_palms, sample_palms, views_around
from omomo_core.generation.selection.ranking import rank
from omomo_core.generation.solving.config import BODY_SOLVING
from omomo_core.motion import HandMotion, HumanMotion, ObjectMotion
from omomo_core.stages.hands.contact_rule import constrain
from omomo_core.stages.stage import Stages
from omomo_core.stages.windows import WINDOW


def generate_as_published(
    motion: ObjectMotion,
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress,
) -> Generation:
    """Return samples of the published model for one window, ranked (OMOMO sections 3.3 and 3.4).

    Raises:
        InputError: the motion is longer than the model's window.
    """
    if len(motion.T_world_object) > WINDOW:
        raise InputError(
            "paper-too-long",
            f"The paper's model makes {WINDOW / 30:.0f} s of motion; "
            f"this one lasts {len(motion.T_world_object) / 30:.1f} s.",
            fix="Use the default configuration (--config capture), which has no limit.",
        )
    object_model = ObjectModel(motion.mesh, 1.0)
    clip = object_model.clip(motion.T_world_object)
    view = views_around(clip.take, options.samples)
    generator = torch.Generator().manual_seed(options.seed)
    palms = sample_palms(
        view, stages.hands, options, generator, lambda done: progress("hands", done)
    )
    hands = [_contact(p, clip, options) for p in palms]
    humans = bodies_from_palms(
        view, hands, body, stages.body, options, generator, lambda done: progress("body", done)
    )
    people = tuple(
        _judged(human, hand, body, clip, object_model)
        for human, hand in zip(humans, hands, strict=True)
    )
    return rank(people, clip.must_hold)


def _judged(
    human: HumanMotion,
    hands: HandMotion,
    body: BodyModel,
    clip: ObjectClip,
    object_model: ObjectModel,
) -> Person:
    """Return a person with palm misses and penetration depths, although nothing is solved here."""
    root, R, T = (
        torch.from_numpy(a) for a in (human.root, human.rotations, clip.take.motion.T_world_object)
    )
    miss = np.linalg.norm(human.joints[:, 22:] - hands.palms, axis=-1) * (
        hands.contact > BODY_SOLVING.full_hold
    )
    depth = penetration_depth(body, root, R, T, object_model.obstacle)
    return Person(human, (), miss, depth.double().numpy())


def _contact(
    palms: Float[np.ndarray, "frames 2 3"], clip: ObjectClip, options: GenerationOptions
) -> HandMotion:
    motion = clip.take.motion
    T = motion.T_world_object
    published = constrain(palms, motion.mesh.vertices, T)
    if options.contact == "paper":
        return published
    # Stage 1 as published has no contact channel: the rule's labels become the segments.
    labels = HandMotion(palms=palms, contact=published.contact)
    surface = clip.take.surface
    return follow_anchors(decode(labels, surface, T, clip.must_hold), labels, T, surface)
