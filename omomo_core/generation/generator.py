"""The generator: an object motion in, K people who move it out, ranked (OMOMO section 3)."""

import numpy as np

from omomo_core.body.model import BodyModel
from omomo_core.generation.chunks import RECORDED
from omomo_core.generation.conditioning import NOTHING, Known
from omomo_core.generation.paper import generate_as_published
from omomo_core.generation.person import joined
from omomo_core.generation.result import Generation, GenerationOptions, Progress, silent
from omomo_core.generation.selection.ranking import ranked
from omomo_core.generation.stream import Block, stream
from omomo_core.motion import ObjectMotion
from omomo_core.stages.stage import Stages


def generate(
    motion: ObjectMotion,
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress = silent,
    known: Known = NOTHING,
) -> Generation:
    """Generate the people who could have moved the object.

    Args:
        motion: the object, world z up with the floor at 0, metres, 30 fps, every frame valid.
        body: who moves it; another stature is the same scene scaled.
        stages: the trained networks.
        options: samples, seed, contact rule, sampler.
        progress: told what is being done.
        known: palms, contacts or first pose, where they need not be guessed (not in the paper's model).

    Returns:
        The samples in the world of `motion`. The same arguments give the same result.
    """
    if stages.hands.config.configuration == "paper":
        return generate_as_published(motion, body, stages, options, progress)
    poses = motion.T_world_object
    blocks: list[Block] = []

    def overall(name: str, done: float) -> None:
        before = sum(len(block.must_hold) for block in blocks)
        now = min(RECORDED.length, len(poses) - before)
        progress(name, (before + done * now) / len(poses))

    for block in stream(
        motion.mesh, poses, body, stages, options, overall, known, chapters=RECORDED
    ):
        blocks.append(block)
    people = tuple(joined([b.people[k] for b in blocks]) for k in range(options.samples))
    return ranked(people, np.concatenate([b.must_hold for b in blocks]))
