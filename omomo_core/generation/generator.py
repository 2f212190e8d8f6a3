"""The generator: an object motion in, K people who move it out, ranked (OMOMO section 3)."""

import torch

from omomo_core.body.load import load_body
from omomo_core.body.model import BodyModel
from omomo_core.generation.body import sample_body
from omomo_core.generation.choose import choose
from omomo_core.generation.fit import Fit
from omomo_core.generation.hands import sample_hands
from omomo_core.generation.known import NOTHING, Known, hands_pin, start_from
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
    known: Known = NOTHING,
) -> Generation:
    """Generate the people who could have moved the object.

    Args:
        motion: the object, world z up with the floor at 0, metres, 30 fps, every frame valid.
        body: who moves it; another stature is the same scene scaled.
        stages: the trained networks.
        options: samples, seed, contact rule, sampler.
        progress: told what is being done.
        known: palms or first pose, where they need not be guessed (not in the paper's model).

    Returns:
        The samples in the world of `motion`. The same arguments give the same result.
    """
    if stages.hands.config.configuration == "paper":
        return generate_as_published(motion, body, stages, options, progress)
    scene, fit = scene_of(motion, body.height, stages.height), Fit(load_body(), body)
    generator = torch.Generator().manual_seed(options.seed)
    start, pin = known.first_frame, None
    if start is not None:
        pin = hands_pin(start, scene, fit)
    if known.hands is None:
        hands = sample_hands(scene, stages.hands, options, generator, progress, pin)
    else:
        hands = [known.hands] * options.samples
    if start is not None:
        hands = [start_from(hand, start, fit) for hand in hands]
    people = sample_body(
        scene,
        hands,
        fit,
        stages.body,
        options,
        generator,
        progress,
        start=start,
        certain=known.hands is not None,
    )
    motions = tuple(human for human, _ in people)
    scores = tuple(score(human, scene.take, miss, scene.moving) for human, miss in people)
    chosen = choose(motions, scores)
    return Generation(motions, chosen, scores, notes_of(scores[chosen]))
