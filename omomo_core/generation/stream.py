"""Generation chunk by chunk: any length of take, sampled ahead of what is solved.

A take of any length is generated in chunks that begin with a prefix from the chunk before, so memory does
not grow with the take, and poses may still be arriving. A chunk is sampled, then solved. The next one needs
only the sample to be sampled, so both can be done at the same time.
"""

from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import chain
from threading import Event
from typing import TypeVar

import numpy as np
import torch
from jaxtyping import Bool, Float

from omomo_core.body.model import BodyModel
from omomo_core.compute import LITTLE_TO_SOLVE, sample_groups, torch_threads
from omomo_core.generation.conditioning import (
    UNCONDITIONED,
    Conditioning,
)
from omomo_core.generation.decoding import solve_people
from omomo_core.generation.generation_config import LIVE, ChunkSizes
from omomo_core.generation.generation_options import (
    GenerationOptions,
    Progress,
    SolvedPrefix,
    no_progress,
)
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.person import Person, stretch
from omomo_core.generation.sample_chunks import SampledChunk, sample_chunks
from omomo_core.generation.solving.bodies import SolvedBodies
from omomo_core.motion import ObjectMesh
from omomo_core.stages.stage import Stages
from omomo_core.system import one_blas_thread

T = TypeVar("T")


class _Abandoned(Exception):
    """Nobody waits for the next item any more."""


def one_ahead(make: Callable[[Progress], Iterator[T]], progress: Progress) -> Generator[T]:
    """Yield the items of `make`, of which the next one is always made in a second thread.

    What `make` or `progress` raises there is raised here in the item's place. When the generator is closed,
    the thread ends at its next progress, and is waited for.

    Args:
        make: makes the items, and tells its progress to what it is given.
        progress: told of it, in the second thread.
    """
    abandoned = Event()

    def told(step: str, done: float) -> None:
        if abandoned.is_set():
            raise _Abandoned
        progress(step, done)

    items = make(told)
    with ThreadPoolExecutor(1) as pool:
        try:
            coming = pool.submit(next, items, None)
            while (item := coming.result()) is not None:
                coming = pool.submit(next, items, None)
                yield item
        finally:
            abandoned.set()


@dataclass(frozen=True)
class GeneratedChunk:
    """A finished stretch of each sample: frames `first` .. `first + frames` of the take."""

    first: int
    people: tuple[Person, ...]
    must_hold: Bool[np.ndarray, " frames"]
    """True where somebody must hold the object."""


def stream(
    mesh: ObjectMesh,
    poses: Iterable[Float[np.ndarray, "4 4"]],
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    progress: Progress = no_progress,
    conditioning: Conditioning = UNCONDITIONED,
    *,
    chunk_sizes: ChunkSizes = LIVE,
    complete: bool = False,
) -> Iterator[GeneratedChunk]:
    """Yield the people who could have moved the object, while its poses arrive.

    Args:
        mesh: the object.
        poses: T_world_object at 30 fps, world z up with the floor at 0, metres; read as needed.
        body: who moves it; another stature is the same scene scaled.
        stages: the trained networks (capture configuration).
        options: samples, seed, contact rule, sampler.
        progress: called with the name of the step and the fraction done, for each chunk anew.
        conditioning: what is given instead of being sampled.
        chunk_sizes: how many frames are generated at once: `RECORDED` or `LIVE`.
        complete: all poses are there. While a chunk is solved, a second thread samples the next one; it
            reads the poses and calls `progress`, too.

    Yields:
        Chunks in the order of time, without gap or overlap. The same arguments give the same chunks.
    """
    object_model = ObjectModel(mesh, stages.height / body.height, body.shoe_sole)
    threads = torch.get_num_threads()

    def sampled(progress: Progress) -> Iterator[SampledChunk]:
        return sample_chunks(
            object_model, poses, body, stages, options, conditioning, chunk_sizes, progress, threads
        )

    # With one thread, as workers of a batch have it, two would take turns.
    together = complete and threads > 1
    prefix: SolvedPrefix | None = None
    try:
        for sample in one_ahead(sampled, progress) if together else sampled(progress):
            chunk = sample.chunk
            people, solved = _solve(sample, object_model, body, prefix, progress, threads)
            if not chunk.last:
                rows = chunk.handed_on(chunk_sizes.context)
                fingers = np.stack([p.human.fingers[rows] for p in people])
                prefix = replace(solved.prefix(rows), fingers=torch.from_numpy(fingers))
            yield _finished(sample, people)
    finally:
        # What threads get that begin from now on: those of the networks have left 1.
        torch.set_num_threads(threads)


def _finished(sample: SampledChunk, people: list[Person]) -> GeneratedChunk:
    """Return the frames that a chunk yields."""
    first, stop = sample.chunk.prefix_frames, sample.chunk.stop
    return GeneratedChunk(
        first=sample.chunk.first + first,
        people=tuple(stretch(p, first, stop) for p in people),
        must_hold=sample.clip.must_hold[first:stop],
    )


def _solve(
    sample: SampledChunk,
    object_model: ObjectModel,
    body: BodyModel,
    prefix: SolvedPrefix | None,
    progress: Progress,
    threads: int,
) -> tuple[list[Person], SolvedBodies]:
    """Return all frames of a sampled chunk, solved in as many groups of samples as threads help."""
    before = sample.posed if prefix is None else prefix
    samples, frames = len(sample.hands), sample.chunk.frames
    groups = sample_groups(samples, frames, threads)
    each = 1 if samples * frames <= LITTLE_TO_SOLVE else max(1, threads // len(groups))

    def solved(some: slice) -> tuple[list[Person], SolvedBodies]:
        with torch_threads(each):
            return solve_people(
                sample.bodies.select(some),
                sample.hands[some],
                sample.segments[some],
                sample.clip,
                object_model,
                body,
                None if before is None else before.select(some),
                palms_known=sample.palms_known,
                on_progress=lambda done: progress("solve", done),
            )

    with one_blas_thread(), ThreadPoolExecutor(len(groups)) as pool:
        people, bodies = zip(*pool.map(solved, groups), strict=True)
    progress("solve", 1.0)
    return list(chain.from_iterable(people)), SolvedBodies.join(bodies)
