"""The generator as a stream: poses of the object in, finished chunks of K people out.

A take of any length is generated in chunks that begin with a prefix from the chunk before, so memory does
not grow with the take, and poses may still be arriving.
"""

from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body.load import load_body
from omomo_core.body.model import BodyModel
from omomo_core.body.trajectory_optimization.targets import InteractionTargets
from omomo_core.contact.segment import ContactSegment, follow_anchors
from omomo_core.generation.collision.contact_face import Held, choose_contact_faces
from omomo_core.generation.conditioning import (
    UNCONDITIONED,
    Conditioning,
    prefix_from_pose,
    start_constraint,
)
from omomo_core.generation.config import LIVE, ChunkSizes
from omomo_core.generation.decoding import SampledBodies, interaction_targets, solve_people
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import Person, shift_spans, stretch
from omomo_core.generation.prefix import FeaturePrefix, Prefix
from omomo_core.generation.result import GenerationOptions, Progress, no_progress
from omomo_core.generation.retargeting import Retargeting
from omomo_core.generation.sampling.body import sample_body
from omomo_core.generation.sampling.hands import decode_hands, impose_palm_prefix, sample_hands
from omomo_core.generation.solving.bodies import SolvedBodies
from omomo_core.motion import HandMotion, ObjectMesh
from omomo_core.stages.stage import Stages

LITTLE = 1500
"""Frames of all samples together up to which torch is faster with one thread than with several.

Of takes of 4 s one thread makes 1 sample in 0.43 s and 4 in 0.77; two threads make them in 0.49 and 0.93;
20 samples take as long either way (2 cores).
"""


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
    """Where somebody must hold the object."""


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

    Yields:
        Chunks in the order of time, without gap or overlap. The same arguments give the same chunks.
    """
    maker = _ChunkGenerator(
        ObjectModel(mesh, stages.height / body.height),
        Retargeting(load_body(), body),
        stages,
        options,
        progress,
        torch.Generator().manual_seed(options.seed),
    )
    prefix: Prefix | None = None
    for chunk in split_into_chunks(poses, chunk_sizes):
        with threads_for(options.samples * len(chunk.T_world_object)):
            draft = maker.draft(chunk, conditioning, prefix)
        now = range(chunk.prefix_frames, chunk.stop)
        people = tuple(stretch(p, now.start, now.stop) for p in draft.people)
        must_hold = draft.clip.must_hold[now.start : now.stop]
        yield GeneratedChunk(chunk.first + now.start, people, must_hold)
        if not chunk.last:
            prefix = draft.prefix(chunk.stop - chunk_sizes.context, chunk.stop)


@dataclass(frozen=True)
class _Draft:
    """A chunk as sampled and solved, with all its frames."""

    clip: ObjectClip
    hands: Float[Tensor, "samples frames 8"] | None
    """None where the palms are given."""
    body: Float[Tensor, "samples frames channels"]
    palms: Float[np.ndarray, "samples frames 2 3"]
    solved: SolvedBodies
    people: list[Person]

    def prefix(self, start: int, stop: int) -> Prefix:
        """Return the prefix of the next chunk, which begins at `start`."""
        rows = slice(start, stop)
        return Prefix(
            hands=None if self.hands is None else FeaturePrefix.all(self.hands[:, rows]),
            body=FeaturePrefix.all(self.body[:, rows]),
            root=self.solved.root[:, rows],
            rotations=self.solved.rotations[:, rows],
            palms=self.palms[:, rows],
            standing=self.solved.standing[:, rows],
            segments=[shift_spans(p.segments, start, stop) for p in self.people],
            fingers=torch.from_numpy(np.stack([p.human.fingers[rows] for p in self.people])),
        )


@dataclass(frozen=True)
class _ChunkGenerator:
    """Samples and solves one chunk after another."""

    object_model: ObjectModel
    retargeting: Retargeting
    stages: Stages
    options: GenerationOptions
    progress: Progress
    generator: torch.Generator

    def draft(self, chunk: Chunk, conditioning: Conditioning, prefix: Prefix | None) -> _Draft:
        """Return all frames of a chunk, sampled and solved."""
        clip = self.object_model.clip(chunk.T_world_object)
        if conditioning.start_pose is not None and chunk.first == 0:
            prefix = prefix_from_pose(
                conditioning.start_pose, clip, self.retargeting, self.options.samples
            )
        self.progress("object", 1.0)
        features, hands, segments = self._hands(clip, chunk, conditioning, prefix)
        self.progress("contact", 1.0)
        x = sample_body(
            clip, hands, self.stages.body, self.options, self.generator, self.progress, prefix
        )
        sampled = SampledBodies.of(x, self.retargeting)
        if conditioning.hands is None and conditioning.contacts is None:
            first = 0 if prefix is None else prefix.frames
            hands, segments = self._on_better_faces(sampled, hands, segments, clip, first)
        people, solved = solve_people(
            sampled,
            hands,
            segments,
            clip,
            self.object_model,
            self.retargeting.body,
            prefix,
            palms_known=conditioning.hands is not None,
            on_progress=lambda done: self.progress("solve", done),
        )
        self.progress("solve", 1.0)
        return _Draft(clip, features, x, np.stack([h.palms for h in hands]), solved, people)

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
                else follow_anchors(new, hand, T)
                for old, new, hand in zip(segments, held, hands, strict=True)
            ]

        def targets_for(held: Held) -> InteractionTargets:
            return interaction_targets(R, followed(held), held, clip, object_model)

        held = choose_contact_faces(
            self.retargeting.body, sampled.root, R, segments, object_model, targets_for, first
        )
        return followed(held), held

    def _hands(
        self, clip: ObjectClip, chunk: Chunk, conditioning: Conditioning, prefix: Prefix | None
    ) -> tuple[Tensor | None, list[HandMotion], list[tuple[ContactSegment, ...]]]:
        """Return the features, palms and segments of stage 1, or what is given in their place."""
        start, stop = chunk.first, chunk.first + len(chunk.T_world_object)
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
        )
        contacts = (
            None
            if conditioning.contacts is None
            else shift_spans(conditioning.contacts, start, stop)
        )
        return x, *decode_hands(x, clip, self.options, prefix, contacts)


@contextmanager
def threads_for(frames: int) -> Generator[None]:
    """Limit torch to as many threads as help; afterwards it has as many as before.

    Args:
        frames: of all samples together.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1 if frames <= LITTLE else before)
    try:
        yield
    finally:
        torch.set_num_threads(before)
