"""The generator: an object motion in, K people who move it out, ranked (OMOMO section 3)."""

from collections import Counter

import numpy as np

from omomo_core.body.model import BodyModel
from omomo_core.generation.conditioning import UNCONDITIONED, Conditioning
from omomo_core.generation.generation_config import RECORDED
from omomo_core.generation.generation_options import (
    Generation,
    GenerationOptions,
    Progress,
    no_progress,
)
from omomo_core.generation.paper_generator import generate_as_published
from omomo_core.generation.person import join
from omomo_core.generation.selection.ranking import rank
from omomo_core.generation.stream import stream
from omomo_core.motion import ObjectMotion
from omomo_core.stages.stage import Stages
from omomo_core.system import one_blas_thread


def generate(
    motion: ObjectMotion,
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress = no_progress,
    conditioning: Conditioning = UNCONDITIONED,
) -> Generation:
    """Return K samples of a person who could have moved the object, ranked.

    Args:
        motion: the object, world z up with the floor at 0, metres, 30 fps, every frame valid.
        body: who moves it; another stature is the same scene scaled.
        stages: the trained networks.
        options: samples, seed, contact rule, sampler.
        progress: called with the name of the step and the fraction done.
        conditioning: palms, contacts, first pose or start position that are given (not in the paper's model).

    Returns:
        The samples in the world of `motion`. The same arguments give the same result.
    """
    if stages.hands.config.configuration == "paper":
        return generate_as_published(motion, body, stages, options, progress)
    poses = motion.T_world_object
    finished: Counter[str] = Counter()

    def overall(name: str, done: float) -> None:
        before = finished[name] * RECORDED.step
        now = min(RECORDED.length, len(poses) - before)
        finished[name] += done == 1.0
        progress(name, (before + done * now) / len(poses))

    # Two threads must not each change how many threads BLAS has.
    with one_blas_thread():
        made = stream(
            motion.mesh,
            poses,
            body,
            stages,
            options,
            overall,
            conditioning,
            chunk_sizes=RECORDED,
            complete=True,
        )
        chunks = list(made)
    people = tuple(join([b.people[k] for b in chunks]) for k in range(options.samples))
    return rank(people, np.concatenate([b.must_hold for b in chunks]))
