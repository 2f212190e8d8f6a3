"""The generator: an object motion in, K people who move it out, ranked (OMOMO section 3)."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from omomo_core.body.model import BodyModel
from omomo_core.generation.conditioning import UNCONDITIONED, Conditioning
from omomo_core.generation.generation_config import RECORDED
from omomo_core.generation.generation_options import (
    Generation,
    GenerationOptions,
    Progress,
    no_progress,
    notes_of,
)
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.paper_generator import generate_as_published
from omomo_core.generation.person import GrowingPerson
from omomo_core.generation.sample_chunks import sample_chunks
from omomo_core.generation.sampled_file import save_sampled
from omomo_core.generation.sampled_take import SampledTake
from omomo_core.generation.selection.ranking import (
    choose,
    is_good,
    order_as_sampled,
    rank,
    score,
)
from omomo_core.generation.selection.selection_config import SCORE
from omomo_core.generation.stream import stream
from omomo_core.motion import ObjectMotion
from omomo_core.stages.stage import Stages
from omomo_core.system import give_back_memory, one_blas_thread


def generate(
    motion: ObjectMotion,
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress = no_progress,
    conditioning: Conditioning = UNCONDITIONED,
    sampled_file: Path | None = None,
) -> Generation:
    """Return K samples of a person who could have moved the object, ranked.

    Args:
        motion: the object, world z up with the floor at 0, metres, 30 fps, every frame valid.
        body: who moves it; another stature is the same scene scaled.
        stages: the trained networks.
        options: samples, seed, contact rule, sampler.
        progress: called with the name of the step and the fraction done.
        conditioning: palms, contacts, first pose or start position that are given (not in the paper's model).
        sampled_file: where the sampled take is written if only what is shown is solved, so that the others
            can be solved later (`load_sampled`). What is made lies beside it, in files without names, and not
            in memory; None for memory.

    Returns:
        The samples in the world of `motion`. The same arguments give the same result.
    """
    if stages.hands.config.configuration == "paper":
        return generate_as_published(motion, body, stages, options, progress)
    poses = motion.T_world_object
    overall = _over_chunks(progress, len(poses))
    if options.solve == "shown" and options.samples > 1:
        take = sample_take(motion, body, stages, options, overall, conditioning, sampled_file)
        return _solved_to_show(take, progress, shortest_way=conditioning.only_start_position)
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
        folder = None if sampled_file is None else sampled_file.parent
        people = [GrowingPerson(folder) for _ in range(options.samples)]
        must_hold: list[np.ndarray] = []
        for chunk in made:
            for person, part in zip(people, chunk.people, strict=True):
                person.add(part)
            must_hold.append(chunk.must_hold)
            give_back_memory()
    return rank(
        [person.whole() for person in people],
        np.concatenate(must_hold),
        shortest_way=conditioning.only_start_position,
    )


def _over_chunks(progress: Progress, frames: int) -> Progress:
    """Return a progress callback for each chunk anew, which tells how much of the whole take is done."""
    finished: Counter[str] = Counter()

    def overall(name: str, done: float) -> None:
        before = finished[name] * RECORDED.step
        now = min(RECORDED.length, frames - before)
        finished[name] += done == 1.0
        progress(name, (before + done * now) / frames)

    return overall


def sample_take(
    motion: ObjectMotion,
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress = no_progress,
    conditioning: Conditioning = UNCONDITIONED,
    sampled_file: Path | None = None,
) -> SampledTake:
    """Return a take of which all samples are sampled and none is solved; the arguments are `generate`'s."""
    model = ObjectModel(motion.mesh, stages.height / body.height, body.shoe_sole)
    with one_blas_thread():
        chunks = sample_chunks(
            model,
            motion.T_world_object,
            body,
            stages,
            options,
            conditioning,
            RECORDED,
            progress,
            torch.get_num_threads(),
        )
        if sampled_file is not None:
            return save_sampled(sampled_file, chunks, model, body)
        # What the networks gave has done its work when the next chunk is sampled.
        return SampledTake([replace(chunk, features=None) for chunk in chunks], model, body)


def _solved_to_show(take: SampledTake, progress: Progress, *, shortest_way: bool) -> Generation:
    """Return the samples, solved in the order in which they rank as sampled, until one is good."""
    must_hold = take.must_hold
    people = [take.as_sampled(k) for k in range(take.samples)]
    order, told = order_as_sampled(people, must_hold, shortest_way=shortest_way)
    scores, solved = list(told), list[int]()
    for k in order if len(take.chunks) == 1 else order[: SCORE.most_solved]:
        people[k] = take.solve(k, lambda done: progress("solve", done))
        scores[k] = score(people[k], must_hold)
        solved.append(k)
        if is_good(scores[k], len(must_hold)):
            chosen = k
            break
    else:
        everyone = len(solved) == take.samples
        fewest = min(solved, key=lambda k: scores[k]["total"])
        motions = [p.human for p in people]
        chosen = choose(motions, scores, shortest_way=shortest_way) if everyone else fewest
    return Generation(
        tuple(people),
        chosen,
        tuple(scores),
        notes_of(scores[chosen]),
        frozenset(range(take.samples)) - set(solved),
    )
