"""The published generator: one window of four seconds, no release, nothing solved afterwards.

Its networks see the object from where the person stands and faces in the first frame, which no phone
knows: each sample tries another place around the object, and the ranking picks.
"""

import numpy as np
import torch
from jaxtyping import Float

from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.penetration import depth_inside
from omomo_core.contact.decode import decode
from omomo_core.contact.segment import follow
from omomo_core.errors import InputError
from omomo_core.generation.object_clip import Scene, Thing
from omomo_core.generation.person import Person
from omomo_core.generation.result import Generation, GenerationOptions, Progress
from omomo_core.generation.sampling.paper import around, draw_from_palms, draw_palms
from omomo_core.generation.selection.ranking import ranked
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
    """OMOMO sections 3.3 and 3.4 on one window.

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
    thing = Thing(motion.mesh, 1.0)
    scene = thing.scene(motion.T_world_object)
    view = around(scene.take, options.samples)
    generator = torch.Generator().manual_seed(options.seed)
    palms = draw_palms(view, stages.hands, options, generator, lambda done: progress("hands", done))
    hands = [_contact(p, scene, options) for p in palms]
    humans = draw_from_palms(
        view, hands, body, stages.body, options, generator, lambda done: progress("body", done)
    )
    people = tuple(
        _judged(human, hand, body, scene, thing) for human, hand in zip(humans, hands, strict=True)
    )
    return ranked(people, scene.must_hold)


def _judged(
    human: HumanMotion, hands: HandMotion, body: BodyModel, scene: Scene, thing: Thing
) -> Person:
    """Nothing is solved afterwards, but what is wrong is told all the same."""
    root, R, T = (
        torch.from_numpy(a) for a in (human.root, human.rotations, scene.take.motion.T_world_object)
    )
    miss = np.linalg.norm(human.joints[:, 22:] - hands.palms, axis=-1) * (hands.contact > 0.99)
    depth = depth_inside(body, root, R, T, thing.barrier)
    return Person(human, (), miss, depth.double().numpy())


def _contact(
    palms: Float[np.ndarray, "frames 2 3"], scene: Scene, options: GenerationOptions
) -> HandMotion:
    motion = scene.take.motion
    T = motion.T_world_object
    published = constrain(palms, motion.mesh.vertices, T)
    if options.contact == "paper":
        return published
    # Stage 1 as published has no contact channel: the rule's labels become the segments.
    labels = HandMotion(palms=palms, contact=published.contact)
    return follow(decode(labels, scene.take.surface, T, scene.must_hold), labels, T)
