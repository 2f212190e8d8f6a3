"""Sampling of a take chunk by chunk: palms, contacts and bodies of K people, before any of them is solved.

A chunk begins with a prefix from the chunk before. Only the sample before it is needed to sample the next
one, so solving may go on beside it, or wait until the whole take is sampled.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.body.model import BodyModel, load_body
from omomo_core.body.trajectory_optimization.residuals import InteractionTargets
from omomo_core.compute import torch_threads
from omomo_core.contact.segment import ContactSegment, follow_anchors
from omomo_core.generation.collision.approach import Held, choose_contact_faces, lead_around
from omomo_core.generation.conditioning import (
    Conditioning,
    person_constraint,
    prefix_from_pose,
    start_constraint,
)
from omomo_core.generation.decoding import SampledBodies, interaction_targets
from omomo_core.generation.generation_config import ChunkSizes
from omomo_core.generation.generation_options import (
    FeaturePrefix,
    GenerationOptions,
    Prefix,
    Progress,
    SolvedPrefix,
)
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import Retargeting, shift_spans
from omomo_core.generation.sampling.sample_body import sample_body
from omomo_core.generation.sampling.sample_hands import (
    decode_hands,
    impose_palm_prefix,
    sample_hands,
)
from omomo_core.motion import HandMotion
from omomo_core.stages.stage import Stages
from omomo_core.system import give_back_memory


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
class ChunkFeatures:
    """What the networks gave for a chunk: the prefix of the next one is taken from it."""

    hands: Float[Tensor, "samples frames 8"] | None
    """Features of stage 1; None where the palms are given."""
    body: Float[Tensor, "samples frames channels"]
    """Features of stage 2."""


@dataclass(frozen=True)
class SampledChunk:
    """A chunk as sampled, with all its frames."""

    chunk: Chunk
    clip: ObjectClip
    hands: list[HandMotion]
    segments: list[tuple[ContactSegment, ...]]
    bodies: SampledBodies
    palms_known: bool = False
    """The palms are given."""
    posed: SolvedPrefix | None = None
    """The body of a start pose that is given."""
    features: ChunkFeatures | None = None
    """None once the next chunk is sampled."""

    def prefix(self, rows: slice) -> Prefix:
        """Return the prefix of the next chunk, which begins with these frames."""
        features = self.features
        assert features is not None
        hands = features.hands
        return Prefix(
            hands=None if hands is None else FeaturePrefix.all(hands[:, rows]),
            body=FeaturePrefix.all(features.body[:, rows]),
            palms=np.stack([h.palms[rows] for h in self.hands]),
            segments=[shift_spans(held, rows.start, rows.stop) for held in self.segments],
        )

    def select(self, some: slice) -> "SampledChunk":
        """Return those of some samples, which are to be solved."""
        return SampledChunk(
            self.chunk,
            self.clip,
            self.hands[some],
            self.segments[some],
            self.bodies.select(some),
            self.palms_known,
            None if self.posed is None else self.posed.select(some),
        )


def sample_chunks(
    object_model: ObjectModel,
    poses: Iterable[Float[np.ndarray, "4 4"]],
    body: BodyModel,
    stages: Stages,
    options: GenerationOptions,
    conditioning: Conditioning,
    chunk_sizes: ChunkSizes,
    progress: Progress,
    threads: int,
) -> Iterator[SampledChunk]:
    """Yield the chunks of a take as they are sampled; the arguments are those of `stream`.

    Args:
        threads: that networks take at once.
    """
    sampler = _Sampler(
        object_model,
        Retargeting(load_body(), body),
        stages,
        options,
        conditioning,
        progress,
        torch.Generator().manual_seed(options.seed),
        threads,
    )
    prefix: Prefix | None = None
    for chunk in split_into_chunks(poses, chunk_sizes):
        with torch_threads(1):
            sample = sampler.sample(chunk, prefix)
        give_back_memory()
        yield sample
        if not chunk.last:
            prefix = sample.prefix(chunk.handed_on(chunk_sizes.context))


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

    def sample(self, chunk: Chunk, prefix: Prefix | None) -> SampledChunk:
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
        return SampledChunk(
            chunk,
            clip,
            hands,
            segments,
            bodies,
            palms_known=given.hands is not None,
            posed=posed,
            features=ChunkFeatures(features, x),
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
            person=person_constraint(conditioning, clip, last=chunk.last),
            last=chunk.last,
            threads=self.threads,
        )
        contacts = (
            None
            if conditioning.contacts is None
            else shift_spans(conditioning.contacts, start, stop)
        )
        return x, *decode_hands(x, clip, self.options, prefix, contacts, conditioning.held_with)
