"""The generator: an object motion in, K people who move it out, ranked (OMOMO section 3)."""

import numpy as np
import torch

from omomo_core.body.model import BodyModel
from omomo_core.generation.body import sample_body
from omomo_core.generation.hands import sample_hands
from omomo_core.generation.paper import generate_as_published
from omomo_core.generation.result import (
    Generation,
    GenerationOptions,
    Progress,
    Stages,
    notes_of,
)
from omomo_core.generation.scene import scene_of
from omomo_core.generation.scores import score
from omomo_core.motion import ObjectMotion


def generate(
    motion: ObjectMotion,
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress,
) -> Generation:
    """Generate the people who could have moved the object.

    Args:
        motion: the object, world z up with the floor at 0, metres, 30 fps, every frame valid.
        body: who moves it; another stature is the same scene scaled.
        stages: the trained networks.
        options: samples, seed, contact rule, sampler.
        progress: told what is being done.

    Returns:
        The samples in the world of `motion`. The same arguments give the same result.
    """
    if stages.hands.config.configuration == "paper":
        return generate_as_published(motion, body, stages, options, progress)
    scene = scene_of(motion, body.height, stages.height)
    generator = torch.Generator().manual_seed(options.seed)
    hands = sample_hands(scene, stages.hands, options, generator, progress)
    people = sample_body(scene, hands, body, stages.body, options, generator, progress)
    scores = tuple(score(human, scene.take, miss, scene.moving) for human, miss in people)
    chosen = int(np.argmin([s["total"] for s in scores]))
    return Generation(tuple(h for h, _ in people), chosen, scores, notes_of(scores[chosen]))
