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
from torch import Tensor

from omomo_core.body.model import BodyModel, load_body
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets
from omomo_core.compute import LITTLE_TO_SOLVE, sample_groups, torch_threads
from omomo_core.contact.segment import ContactSegment, follow_anchors
from omomo_core.generation.collision.approach import Held, choose_contact_faces, lead_around
from omomo_core.generation.conditioning import (
    UNCONDITIONED,
    Conditioning,
    prefix_from_pose,
    start_constraint,
)
from omomo_core.generation.decoding import SampledBodies, interaction_targets, solve_people
from omomo_core.generation.generation_config import LIVE, ChunkSizes
from omomo_core.generation.generation_options import (
    FeaturePrefix,
    GenerationOptions,
    Prefix,
    Progress,
    SolvedPrefix,
    no_progress,
)
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import Person, Retargeting, shift_spans, stretch
from omomo_core.generation.sampling.sample_body import sample_body
from omomo_core.generation.sampling.sample_hands import (
    decode_hands,
    impose_palm_prefix,
    sample_hands,
)
from omomo_core.generation.solving.bodies import SolvedBodies
from omomo_core.motion import HandMotion, ObjectMesh
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
class Chunk:
    """A stretch of the take: frames `first` .. `first + len(T_world_object)`."""

    first: int
    T_world_object: Float[np.ndarray, "frames 4 4"]
    prefix_frames: int
    """How many of its first frames are fixed."""
    stop: int
    """It yields its frames `prefix_frames` .. `stop`."""
    last: bool

    @property
    def frames(self) -> int:
        """How many frames it has."""
        return len(self.T_world_object)

    def handed_on(self, context: int) -> slice:
        """Return the last frames that it yields, with which the next chunk begins."""
        return slice(self.stop - context, self.stop)


def split_into_chunks(
    poses: Iterable[Float[np.ndarray, "4 4"]], sizes: ChunkSizes
) -> Iterator[Chunk]:
    """Yield chunks as soon as their poses have arrived; every frame is yielded by exactly one."""
    held: list[Float[np.ndarray, "4 4"]] = []
    first = prefix_frames = 0
    for pose in poses:
        held.append(pose)
        if len(held) <= sizes.length + sizes.spare:
            continue
        stop = sizes.length - sizes.margin
        yield Chunk(first, np.stack(held[: sizes.length]), prefix_frames, stop, last=False)
        gone = stop - sizes.context
        del held[:gone]
        first, prefix_frames = first + gone, sizes.context
    if len(held) > prefix_frames:
        yield Chunk(first, np.stack(held), prefix_frames, len(held), last=True)


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
    retargeting, threads = Retargeting(load_body(), body), torch.get_num_threads()
    generator = torch.Generator().manual_seed(options.seed)

    def sampled(progress: Progress) -> Iterator[_SampledChunk]:
        sampler = _Sampler(
            object_model, retargeting, stages, options, conditioning, progress, generator, threads
        )
        prefix: Prefix | None = None
        for chunk in split_into_chunks(poses, chunk_sizes):
            with torch_threads(1):
                sample = sampler.sample(chunk, prefix)
            yield sample
            if not chunk.last:
                prefix = sample.prefix(chunk.handed_on(chunk_sizes.context))

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


def _finished(sample: "_SampledChunk", people: list[Person]) -> GeneratedChunk:
    """Return the frames that a chunk yields."""
    first, stop = sample.chunk.prefix_frames, sample.chunk.stop
    return GeneratedChunk(
        first=sample.chunk.first + first,
        people=tuple(stretch(p, first, stop) for p in people),
        must_hold=sample.clip.must_hold[first:stop],
    )


@dataclass(frozen=True)
class _SampledChunk:
    """A chunk as sampled, with all its frames."""

    chunk: Chunk
    clip: ObjectClip
    features: Float[Tensor, "samples frames 8"] | None
    """Features of stage 1; None where the palms are given."""
    body_features: Float[Tensor, "samples frames channels"]
    hands: list[HandMotion]
    segments: list[tuple[ContactSegment, ...]]
    bodies: SampledBodies
    palms_known: bool
    """The palms are given."""
    posed: SolvedPrefix | None
    """The body of a start pose that is given."""

    def prefix(self, rows: slice) -> Prefix:
        """Return the prefix of the next chunk, which begins with these frames."""
        return Prefix(
            hands=None if self.features is None else FeaturePrefix.all(self.features[:, rows]),
            body=FeaturePrefix.all(self.body_features[:, rows]),
            palms=np.stack([h.palms[rows] for h in self.hands]),
            segments=[shift_spans(held, rows.start, rows.stop) for held in self.segments],
        )


def _solve(
    sample: _SampledChunk,
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


@dataclass(frozen=True)
class _Sampler:
    """Samples one chunk after another."""

    object_model: ObjectModel
    retargeting: Retargeting
    stages: Stages
    options: GenerationOptions
    conditioning: Conditioning
    progress: Progress
    generator: torch.Generator
    threads: int

    def sample(self, chunk: Chunk, prefix: Prefix | None) -> _SampledChunk:
        """Return all frames of a chunk, sampled."""
        clip = self.object_model.clip(chunk.T_world_object)
        given, posed = self.conditioning, None
        if given.start_pose is not None and chunk.first == 0:
            prefix, posed = prefix_from_pose(
                given.start_pose, clip, self.retargeting, self.options.samples
            )
        self.progress("object", 1.0)
        features, hands, segments = self._hands(clip, chunk, prefix)
        first = 0 if prefix is None else prefix.frames
        hands = lead_around(hands, segments, clip, self.object_model, first)
        self.progress("contact", 1.0)
        x = sample_body(
            clip,
            hands,
            self.stages.body,
            self.options,
            self.generator,
            self.progress,
            prefix,
            threads=self.threads,
        )
        bodies = SampledBodies.of(x, self.retargeting)
        if given.hands is None and given.contacts is None:
            hands, segments = self._on_better_faces(bodies, hands, segments, clip, first)
        return _SampledChunk(
            chunk, clip, features, x, hands, segments, bodies, given.hands is not None, posed
        )

    def _on_better_faces(
        self,
        sampled: SampledBodies,
        hands: list[HandMotion],
        segments: list[tuple[ContactSegment, ...]],
        clip: ObjectClip,
        first: int,
    ) -> tuple[list[HandMotion], list[tuple[ContactSegment, ...]]]:
        T, R, object_model = clip.take.motion.T_world_object, sampled.rotations, self.object_model

        def followed(held: Held) -> list[HandMotion]:
            # Palms whose segments have not changed are not blended a second time.
            return [
                hand
                if all(a is b for a, b in zip(old, new, strict=True))
                else follow_anchors(new, hand, T, clip.take.surface)
                for old, new, hand in zip(segments, held, hands, strict=True)
            ]

        def targets_for(held: Held) -> InteractionTargets:
            return interaction_targets(R, followed(held), held, clip, object_model)

        outside = [
            tuple(s if s.start < first else object_model.with_anchor_outside(s) for s in own)
            for own in segments
        ]
        held = choose_contact_faces(
            self.retargeting.body, sampled.root, R, outside, object_model, targets_for, first
        )
        return lead_around(followed(held), held, clip, object_model, first), held

    def _hands(
        self, clip: ObjectClip, chunk: Chunk, prefix: Prefix | None
    ) -> tuple[Tensor | None, list[HandMotion], list[tuple[ContactSegment, ...]]]:
        """Return the features, palms and segments of stage 1, or what is given in their place."""
        start, stop = chunk.first, chunk.first + len(chunk.T_world_object)
        conditioning = self.conditioning
        if conditioning.hands is not None:
            given = HandMotion(
                conditioning.hands.palms[start:stop], conditioning.hands.contact[start:stop]
            )
            if prefix is not None:
                given = impose_palm_prefix(given, prefix.palms[0])
            return None, [given] * self.options.samples, [()] * self.options.samples
        begins = chunk.first == 0
        x = sample_hands(
            clip,
            self.stages.hands,
            self.options,
            self.generator,
            self.progress,
            prefix=None if prefix is None or begins else prefix.hands,
            start=start_constraint(conditioning, prefix, clip) if begins else None,
            last=chunk.last,
            threads=self.threads,
        )
        contacts = (
            None
            if conditioning.contacts is None
            else shift_spans(conditioning.contacts, start, stop)
        )
        return x, *decode_hands(x, clip, self.options, prefix, contacts)
