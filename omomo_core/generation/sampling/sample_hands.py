"""Sampling of stage 1: where the palms of K samples are, and what they hold when."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.contact.decode import NO_PREFIX, ContactPrefix, HandChoice, decode
from omomo_core.contact.segment import ContactSegment, ContactSpan, anchor_spans, follow_anchors
from omomo_core.generation.decoding import despike
from omomo_core.generation.generation_options import (
    FeaturePrefix,
    GenerationOptions,
    Prefix,
    Progress,
    fade,
)
from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.sampling.sample_body import WindowConditions, sample_take
from omomo_core.generation.selection.person_constraint import UNKNOWN_PERSON, PersonConstraint
from omomo_core.generation.selection.plausibility import (
    Hypotheses,
    Samples,
    hypothesis_count,
    order_by_side,
    select_by_coverage,
)
from omomo_core.generation.selection.start_constraint import (
    StartConstraint,
    StartPose,
    select_by_start,
)
from omomo_core.motion import HandMotion
from omomo_core.stages import hands_capture as hand_stage
from omomo_core.stages.hands_capture import LAYOUT
from omomo_core.stages.hands_paper import constrain
from omomo_core.stages.stage import Stage, object_windows, window_frames
from omomo_core.stages.stage_config import BASIS_POINTS


def sample_hands(
    clip: ObjectClip,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
    prefix: FeaturePrefix | None,
    start: StartConstraint | None,
    person: PersonConstraint = UNKNOWN_PERSON,
    *,
    last: bool = True,
    threads: int = 1,
) -> Samples:
    """Return the features of each sample: palms from the object's centre in the networks' world, contacts.

    Without a prefix more hypotheses are sampled than are kept, each of which sees the object from a heading
    of its own; `select_by_coverage` or `select_by_start` selects among them, and neighbours hold from the
    same side.

    Args:
        clip: the object.
        stage: the network.
        options: how many samples, sampler and its steps.
        generator: source of randomness.
        progress: called with "hands" and the fraction done.
        prefix: features of the first frames, where the take goes on.
        start: what is known of a take's first frame.
        person: what else is known of the person.
        last: the take ends with the clip.
        threads: that go through the network.
    """
    begun = _holds_at_start(prefix, start)

    def impose(x: Samples) -> Samples:
        chosen = person.impose_hands(x, None if prefix is None else prefix.values)
        fixed = chosen if prefix is None else prefix.impose(chosen)
        return release_resting_object(fixed, clip, begun, last=last)

    def draw(samples: int) -> Samples:
        return sample_take(
            stage,
            torch.randn(samples, clip.trained.frames, LAYOUT.channels, generator=generator),
            _window_conditions(clip, samples, start, canonical=prefix is not None),
            LAYOUT,
            options,
            generator,
            impose=impose,
            on_step=lambda done: progress("hands", done),
            threads=threads,
        )

    samples = options.samples
    known = start is not None or person.placed
    if prefix is not None or (not known and options.sampler == "ddpm"):
        return person.impose_end(draw(samples))
    return _selected(
        draw(hypothesis_count(samples, placed=person.placed)), clip, samples, start, person
    )


def _selected(
    hypotheses: Hypotheses,
    clip: ObjectClip,
    samples: int,
    start: StartConstraint | None,
    person: PersonConstraint,
) -> Samples:
    """Return the samples that are kept of all hypotheses; neighbours hold from the same side."""
    many = person.fitting(hypotheses, clip, samples)
    if start is None:
        kept = select_by_coverage(many, clip, samples, placed=person.placed)
    else:
        kept = select_by_start(many, start, clip, samples, placed=person.placed)
    return order_by_side(person.impose_end(kept))


def release_resting_object(
    features: Samples, clip: ObjectClip, begun: Bool[Tensor, "#samples"], *, last: bool
) -> Samples:
    """Return the samples without contacts long before the object is first moved, or long after it was last.

    The networks predict such contacts of objects that are pushed, because in most of their training data
    people already stood at them.

    Args:
        features: as the network predicts them.
        clip: the object.
        begun: which samples are known to hold it at the beginning.
        last: the take ends with the clip; otherwise the object may be moved again after it.
    """
    first, stop = clip.touchable_range
    frames = torch.arange(features.shape[1])
    alone = (frames < first) & ~begun[:, None]
    if last:
        alone = alone | (frames >= stop)
    contacts = torch.arange(LAYOUT.channels) >= 3 * LAYOUT.vectors
    return torch.where(alone[..., None] & contacts & (features > 0), -1.0, features)


def _holds_at_start(
    prefix: FeaturePrefix | None, start: StartConstraint | None
) -> Bool[Tensor, " samples"]:
    """Return which samples hold the object in the prefix or the start pose."""
    if prefix is not None:
        return (prefix.values[..., 3 * LAYOUT.vectors :] > 0).flatten(1).any(dim=1)
    posed = isinstance(start, StartPose) and start.holds
    return torch.tensor([posed])


def _window_conditions(
    clip: ObjectClip, samples: int, start: StartConstraint | None, *, canonical: bool
) -> WindowConditions:
    """Return the windows' conditions, seen from the canonical heading or from each sample's own."""
    index = window_frames(clip.trained.frames)
    windows = object_windows(clip.trained, index, samples, BASIS_POINTS)
    own = partial(hand_stage.sampling_yaw, samples=samples)
    yaw = (hand_stage.canonical_yaw if canonical else own)(windows)
    axes = hand_stage.object_axes(windows, yaw)
    begins = hand_stage.UNKNOWN_START.repeat(len(yaw), 1)
    if start is not None:
        begins[:: len(index)] = torch.cat([start.position, torch.ones(1)])
    condition = hand_stage.condition(windows, yaw, axes, begins)
    return WindowConditions(windows.valid, condition, hand_stage.shape_code(windows, axes), axes)


def decode_hands(
    features: Samples,
    clip: ObjectClip,
    options: GenerationOptions,
    prefix: Prefix | None,
    contacts: Sequence[ContactSpan] | None = None,
    held_with: HandChoice | None = None,
) -> tuple[list[HandMotion], list[tuple[ContactSegment, ...]]]:
    """Return palms (world, metres) and contact weights of each sample, and its contact segments.

    Args:
        features: of `sample_hands`.
        clip: the object.
        options: which contact rule.
        prefix: the first frames, where they are fixed.
        contacts: what each hand holds, if that is given; in frames of the clip.
        held_with: which hands hold it, if that is given.
    """
    centre = torch.from_numpy(clip.trained.centre).float().expand(len(features), -1, 3)
    palms, contact = hand_stage.unpack(features, centre)
    hands: list[HandMotion] = []
    held: list[tuple[ContactSegment, ...]] = []
    for k in range(len(features)):
        paths = clip.in_world(palms[k].double().numpy())
        smooth = despike(paths.reshape(-1, 6), 2).reshape(-1, 2, 3)
        sampled = HandMotion(smooth, contact[k].double().numpy())
        given = NO_PREFIX
        if prefix is not None:
            sampled = impose_palm_prefix(sampled, prefix.palms[k])
            given = (
                ContactPrefix(prefix.frames, prefix.segments[k]) if prefix.segments else NO_PREFIX
            )
        hand, segments = _follow_contacts(sampled, clip, options, given, contacts, held_with)
        hands.append(hand)
        held.append(segments)
    return hands, held


def _follow_contacts(
    sampled: HandMotion,
    clip: ObjectClip,
    options: GenerationOptions,
    given: ContactPrefix,
    contacts: Sequence[ContactSpan] | None,
    held_with: HandChoice | None,
) -> tuple[HandMotion, tuple[ContactSegment, ...]]:
    motion, surface = clip.take.motion, clip.take.surface
    T = motion.T_world_object
    if contacts is None and options.contact == "paper":
        return constrain(sampled.palms, motion.mesh.vertices, T), ()
    if contacts is None:
        segments = decode(sampled, surface, T, clip.must_hold, given, held_with)
    else:
        segments = anchor_spans([_keep_anchor(c, given) for c in contacts], sampled, surface, T)
    return follow_anchors(segments, sampled, T, surface), segments


def _keep_anchor(contact: ContactSpan, given: ContactPrefix) -> ContactSpan:
    """Return a given contact with the anchor that it has in the prefix, if it begins there."""
    for s in given.segments:
        if s.hand == contact.hand and s.start <= contact.start < min(s.stop, given.frames):
            return replace(s, start=contact.start, stop=contact.stop)
    return contact


def impose_palm_prefix(sampled: HandMotion, before: Float[np.ndarray, "first 2 3"]) -> HandMotion:
    """Return palms whose first frames are `before`; the change of the last of them fades out after it."""
    first = len(before)
    weight = fade(len(sampled.palms) - first + 1).double().numpy()[1:, None, None]
    rest = sampled.palms[first:] + weight * (before[-1] - sampled.palms[first - 1])
    return replace(sampled, palms=np.concatenate([before, rest]))
