"""Nobody holds what rests long before it is first moved, or long after it was last, unless that is known."""

import numpy as np
import pytest
import torch
from torch import nn

from omomo_core.body.model import load_body
from omomo_core.contact.contact_config import SUPPORT
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.conditioning import UNCONDITIONED, Conditioning
from omomo_core.generation.generation_config import RECORDED, ChunkSizes
from omomo_core.generation.generation_options import FeaturePrefix, GenerationOptions
from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.person import join
from omomo_core.generation.sampling.sample_hands import release_resting_object, sample_hands
from omomo_core.generation.selection.start_constraint import (
    StartConstraint,
    StartPose,
    StartPosition,
)
from omomo_core.generation.stream import stream
from omomo_core.motion import ObjectMotion
from omomo_core.stages.stage import Stages
from tests.core.test_generation import carried, untrained

BODY = load_body()
OPTIONS = GenerationOptions(samples=2, steps=2)
MOVES = 80


def rested(before: int, after: int) -> ObjectMotion:
    """The box rests, is carried for MOVES frames, and rests again."""
    motion = carried(MOVES)
    T = motion.T_world_object
    T = np.concatenate([T[:1].repeat(before, axis=0), T, T[-1:].repeat(after, axis=0)])
    return ObjectMotion(motion.mesh, T, np.ones(len(T), bool))


def always_holding() -> Stages:
    """Networks that say that both hands hold all the time."""
    stages = untrained()
    out = stages.hands.denoiser.out
    nn.init.zeros_(out.weight)
    nn.init.zeros_(out.bias)
    with torch.no_grad():
        out.bias.unflatten(0, (-1, 8))[:, 6:] = 1.0
    return stages


def spans(
    before: int, after: int, known: Conditioning = UNCONDITIONED, how: ChunkSizes = RECORDED
) -> list[tuple[int, int]]:
    """First and last frame of all that the hands of everybody hold."""
    motion = rested(before, after)
    made = stream(
        motion.mesh, motion.T_world_object, BODY, always_holding(), OPTIONS,
        lambda name, done: None, known, chunk_sizes=how,
    )  # fmt: skip
    blocks = list(made)
    people = [join([block.people[k] for block in blocks]) for k in range(2)]
    return [(s.start, s.stop) for person in people for s in person.segments]


@pytest.mark.parametrize(("before", "after"), [(60, 70), (90, 0), (0, 90)])
def test_hands_come_shortly_before_it_moves_and_go_shortly_after(before: int, after: int):
    found = spans(before, after)
    assert len(found) == 4
    # Speeds are means over five frames.
    for start, stop in found:
        assert abs(start - max(before - SUPPORT.gripping, 0)) <= 2
        assert abs(stop - min(before + MOVES + SUPPORT.gripping, before + MOVES + after)) <= 2


@pytest.mark.parametrize(
    ("before", "after"), [(0, 0), (SUPPORT.gripping - 2, SUPPORT.gripping - 2)]
)
def test_what_moves_at_once_or_soon_is_held_from_the_first_frame(before: int, after: int):
    assert spans(before, after) == [(0, before + MOVES + after)] * 4


def test_contacts_that_are_given_are_kept():
    given = [ContactSegment(0, 0, 160, np.array([0.2, 0.0, 0.0]))]
    assert spans(60, 60, Conditioning(contacts=given)) == [(0, 160)] * 2


def test_a_rest_that_lasts_into_later_chapters_is_one():
    how = ChunkSizes(length=100, context=20, margin=SUPPORT.gripping, spare=0)
    found = spans(190, 190, how=how)
    assert abs(min(start for start, _ in found) - (190 - SUPPORT.gripping)) <= 3
    # Only the last chapter knows that the object rests to the end.
    assert 190 + MOVES + SUPPORT.gripping - 3 <= max(stop for _, stop in found) < 190 + MOVES + 190


def clip(before: int, after: int) -> ObjectClip:
    motion = rested(before, after)
    return ObjectModel(motion.mesh, 1.0).clip(motion.T_world_object)


def first_held(prefix: FeaturePrefix | None, start: StartConstraint | None) -> int:
    """First frame with a contact, of any sample."""
    x = sample_hands(
        clip(60, 60), always_holding().hands, OPTIONS, torch.Generator().manual_seed(0),
        lambda name, done: None, prefix, start,
    )  # fmt: skip
    return int((x[..., 6:] > 0).any(dim=-1).any(dim=0).int().argmax())


def test_who_is_known_to_hold_at_first_does():
    free, touching = -torch.ones(8), torch.ones(8)
    assert first_held(None, StartPose(free, torch.zeros(2))) > 25
    assert first_held(None, StartPose(touching, torch.zeros(2))) == 0
    assert first_held(None, StartPosition(torch.tensor([0.3, 0.3]))) > 25
    assert first_held(FeaturePrefix.all(free.expand(2, 5, 8).clone()), None) > 25
    assert first_held(FeaturePrefix.all(touching.expand(2, 5, 8).clone()), None) == 0


def test_only_contacts_of_who_does_not_hold_at_first_are_taken_away():
    rests = clip(60, 60)
    x = torch.full((2, 200, 8), 0.5)
    x[:, :, 7] = -0.3
    begun = torch.tensor([True, False])
    found = release_resting_object(x, rests, begun, last=True)
    first, stop = rests.touchable_range
    changed = found != x
    assert not changed[..., [0, 1, 2, 3, 4, 5, 7]].any()
    assert not changed[0, :stop].any()
    assert changed[1, :first, 6].all()
    assert not changed[1, first:stop].any()
    assert changed[:, stop:, 6].all()
    # Where the take goes on, nobody knows when the object is moved again.
    assert not (release_resting_object(x, rests, begun, last=False) != x)[:, first:].any()
