"""Sampling stage 1: K guesses of where the palms are, and which hold what."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.contact.anchor import anchored
from omomo_core.contact.decode import OPEN, Given, decode
from omomo_core.contact.segment import Segment, Span, follow
from omomo_core.generation.object_clip import Scene
from omomo_core.generation.prefix import Decided, Pin, fade
from omomo_core.generation.result import GenerationOptions, Progress
from omomo_core.generation.sampling.despiking import calmed
from omomo_core.generation.sampling.windows import Told, sample_take
from omomo_core.generation.selection.coverage import around, guesses, of_many
from omomo_core.generation.selection.start_constraint import Posed, Start, like_start
from omomo_core.motion import HandMotion
from omomo_core.stages.capture import BASIS_POINTS
from omomo_core.stages.hands import capture as hand_stage
from omomo_core.stages.hands.capture import LAYOUT
from omomo_core.stages.hands.contact_rule import constrain
from omomo_core.stages.stage import Stage
from omomo_core.stages.windows import object_windows, window_frames

Samples = Float[Tensor, "samples frames 8"]


def sample_hands(
    scene: Scene,
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
    pin: Pin | None,
    start: Start | None,
    *,
    last: bool = True,
) -> Samples:
    """Features of each sample: palms from the object's centre in the networks' world, contacts.

    Where nothing goes on, more are drawn than are kept, each looking at the object from a heading of its own,
    and `of_many` or `like_start` makes the samples of them; neighbours hold from the same side.

    Args:
        scene: the object.
        stage: the network.
        options: how many samples, sampler and its steps.
        generator: source of randomness.
        progress: told how far it is.
        pin: what goes on.
        start: what else is known of the first frame.
        last: the take ends with the scene.
    """

    def draw(samples: int) -> Samples:
        drawn = sample_take(
            stage,
            torch.randn(samples, scene.trained.frames, LAYOUT.channels, generator=generator),
            _told(scene, samples, canonical=pin is not None),
            LAYOUT,
            options,
            generator,
            pin=pin,
            on_step=lambda done: progress("hands", done),
        )
        return left_alone(drawn, scene, _begun(pin, start), last=last)

    samples = options.samples
    if pin is not None or (start is None and options.sampler == "ddpm"):
        return draw(samples)
    many = draw(guesses(samples))
    if start is None:
        return around(of_many(many, scene, samples))
    return around(like_start(many, start, scene, samples))


def left_alone(
    features: Samples, scene: Scene, begun: Bool[Tensor, "#samples"], *, last: bool
) -> Samples:
    """Samples of which nobody holds what rests long before it is first moved, or long after it was last.

    The networks may say so of what is pushed: people who push stood at it in most of what they have seen.

    Args:
        features: as the network says them.
        scene: the object.
        begun: which samples are known to hold it at the beginning.
        last: the take ends with the scene; else nobody knows yet when the object is moved again.
    """
    first, stop = scene.touched
    frames = torch.arange(features.shape[1])
    alone = (frames < first) & ~begun[:, None]
    if last:
        alone = alone | (frames >= stop)
    contacts = torch.arange(LAYOUT.channels) >= 3 * LAYOUT.vectors
    return torch.where(alone[..., None] & contacts & (features > 0), -1.0, features)


def _begun(pin: Pin | None, start: Start | None) -> Bool[Tensor, " samples"]:
    """Which samples hold the object in the frames that are known."""
    if pin is not None:
        return (pin.values[..., 3 * LAYOUT.vectors :] > 0).flatten(1).any(dim=1)
    posed = isinstance(start, Posed) and bool((start.first[3 * LAYOUT.vectors :] > 0).any())
    return torch.tensor([posed])


def _told(scene: Scene, samples: int, *, canonical: bool) -> Told:
    """What the network is told by samples that look from the canonical heading, or each from its own."""
    windows = object_windows(
        scene.trained, window_frames(scene.trained.frames), samples, BASIS_POINTS
    )
    own = partial(hand_stage.guessing_yaw, guesses=samples)
    yaw = (hand_stage.canonical_yaw if canonical else own)(windows)
    axes = hand_stage.object_axes(windows, yaw)
    condition = hand_stage.condition(windows, yaw, axes)
    return Told(windows.valid, condition, hand_stage.shape_code(windows, axes), axes)


def in_contact(
    features: Samples,
    scene: Scene,
    options: GenerationOptions,
    decided: Decided | None,
    contacts: Sequence[Span] | None = None,
) -> tuple[list[HandMotion], list[tuple[Segment, ...]]]:
    """Palms (world, metres) and contact weights of each sample, and its segments.

    Args:
        features: of `sample_hands`.
        scene: the object.
        options: which contact rule.
        decided: what is decided of the first frames.
        contacts: what each hand holds, if that is given; in frames of the scene.
    """
    centre = torch.from_numpy(scene.trained.centre).float().expand(len(features), -1, 3)
    palms, contact = hand_stage.unpack(features, centre)
    hands: list[HandMotion] = []
    held: list[tuple[Segment, ...]] = []
    for k in range(len(features)):
        calm = calmed(palms[k].double().flatten(1).numpy() / scene.scale, 2).reshape(-1, 2, 3)
        guess = HandMotion(calm, contact[k].double().numpy())
        given = OPEN
        if decided is not None:
            guess = starting_at(guess, decided.palms[k])
            given = Given(decided.frames, decided.segments[k]) if decided.segments else OPEN
        hand, segments = _held(guess, scene, options, given, contacts)
        hands.append(hand)
        held.append(segments)
    return hands, held


def _held(
    guess: HandMotion,
    scene: Scene,
    options: GenerationOptions,
    given: Given,
    contacts: Sequence[Span] | None,
) -> tuple[HandMotion, tuple[Segment, ...]]:
    motion, surface = scene.take.motion, scene.take.surface
    T = motion.T_world_object
    if contacts is None and options.contact == "paper":
        return constrain(guess.palms, motion.mesh.vertices, T), ()
    if contacts is None:
        segments = decode(guess, surface, T, scene.must_hold, given)
    else:
        segments = anchored([_as_before(c, given) for c in contacts], guess, surface, T)
    return follow(segments, guess, T), segments


def _as_before(contact: Span, given: Given) -> Span:
    """A contact that has begun in the decided frames keeps the place it got there."""
    for s in given.segments:
        if s.hand == contact.hand and s.start <= contact.start < min(s.stop, given.until):
            return replace(s, start=contact.start, stop=contact.stop)
    return contact


def starting_at(guess: HandMotion, before: Float[np.ndarray, "first 2 3"]) -> HandMotion:
    """Palms whose first frames are decided; what that changes fades out after them."""
    first = len(before)
    weight = fade(len(guess.palms) - first + 1).double().numpy()[1:, None, None]
    rest = guess.palms[first:] + weight * (before[-1] - guess.palms[first - 1])
    return replace(guess, palms=np.concatenate([before, rest]))
