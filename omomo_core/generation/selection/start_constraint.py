"""Start constraint: selection of palm hypotheses where a start position or start pose is known.

The network is told where the person stands at first, so its hypotheses begin near there. Palms of those
that are kept are blended from the start to where they hold.
"""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from omomo_core.generation.generation_options import fade
from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.selection.plausibility import (
    Hypotheses,
    PalmHolds,
    Samples,
    k_medoids,
    kernel_mean,
    standing_position,
    stands_in_front,
)
from omomo_core.generation.selection.selection_config import START
from omomo_core.motion import FPS

_PLACES = 6
_FADE_PEAK = 3 / 2
"""Speed in the middle of a fade, relative to its mean speed."""

First = Float[Tensor, "*b 8"]


@dataclass(frozen=True)
class StartPose:
    """A start constraint: the palms of the first frame are known."""

    first: Float[Tensor, "8"]
    """Features of one frame: palms from the object's centre, metres, and contacts."""
    position: Float[Tensor, "2"]
    """Place of the pelvis above the floor, from the object's centre, metres."""

    @property
    def holds(self) -> bool:
        """Whether a hand holds the object in the first frame."""
        return bool((self.first[_PLACES:] > 0).any())

    def distance(self, first: First) -> Float[Tensor, "*b"]:
        """Return the mean distance of palms from the known ones, given features of first frames; metres."""
        return _palms(first - self.first).norm(dim=-1).mean(dim=-1)

    def in_reach(self, features: Float[Tensor, "*b frames 8"]) -> Bool[Tensor, "*b"]:
        """Return whether both palms can be blended into the hypothesis no faster than people reach."""
        way = _palms(self.first - features[..., 0, :]).norm(dim=-1)
        return (_FADE_PEAK * way * FPS / _blend(features) <= START.fastest_palm).all(dim=-1)

    def impose(self, features: Samples) -> Samples:
        """Return the samples with exactly these palms in their first frame."""
        return impose_start(features, self.first)


@dataclass(frozen=True)
class StartPosition:
    """A start constraint: the place where the person stands in the first frame is known."""

    position: Float[Tensor, "2"]
    """On the floor, from the object's centre, metres."""

    def impose(self, features: Samples) -> Samples:
        """Return the samples from that place, or from as near to it as there is time to come from."""
        way = self.position - standing_position(features[:, 0])
        time = _frames_until_contact(features).amin(dim=-1).clamp(max=START.longest_blend) / FPS
        far = START.fastest_blend / _FADE_PEAK * time
        way = way * (far / way.norm(dim=-1).clamp(min=1e-6)).clamp(max=1)[:, None]
        first = features[:, 0].clone()
        for hand in (0, 1):
            first[:, 3 * hand : 3 * hand + 2] += way
        return impose_start(features, first)


StartConstraint = StartPose | StartPosition
"""What is known of the first frame."""


def select_by_start(
    features: Hypotheses,
    start: StartConstraint,
    clip: ObjectClip,
    samples: int,
    *,
    placed: bool = False,
) -> Samples:
    """Return samples that begin at the known start and cover all hypotheses best (k-medoids).

    The network is told the place, so hypotheses that seem to begin nearest to it are no better than others.
    It is not told where a start pose holds the object: for such a pose, those that begin nearest to its
    palms are taken.
    Hypotheses that are implausible, whose person would have to run around the object, or whose palms would
    have to rush from those of a start pose, are taken only where too few others are left.

    Args:
        features: of all hypotheses, in axes whose third is up.
        start: what is known of the first frame.
        clip: the object.
        samples: how many to keep.
        placed: it is said where the person is later, too, and hypotheses fit that.
    """
    hypotheses = kernel_mean(features)
    possible = torch.from_numpy(PalmHolds.of(hypotheses, clip).plausible)
    possible &= ~_too_far_to_walk(hypotheses, start.position)
    if isinstance(start, StartPose):
        possible &= start.in_reach(hypotheses)
    behind = possible
    if not placed:
        behind = possible & ~torch.from_numpy(stands_in_front(hypotheses, clip))
    for some in (behind, possible):
        if int(some.sum()) >= samples:
            hypotheses = hypotheses[some]
            break
    if isinstance(start, StartPose) and start.holds:
        count = max(math.ceil(START.candidates_per_sample * samples), START.fewest_candidates)
        nearest = start.distance(hypotheses[:, 0]).argsort(stable=True)
        hypotheses = hypotheses[nearest[:count]]
    kept = torch.from_numpy(k_medoids(_palms(hypotheses).double().numpy(), samples))
    return start.impose(hypotheses[kept])


def impose_start(features: Samples, first: Float[Tensor, "*samples 8"]) -> Samples:
    """Return samples that begin with `first`; each hand is unchanged once it holds something."""
    frames = features.shape[1]
    x = features.clone()
    change = first - features[:, 0]
    until = _blend(features)
    for hand in (0, 1):
        places = slice(3 * hand, 3 * hand + 3)
        weight = torch.stack([fade(frames, int(u)) for u in until[:, hand]])
        x[..., places] += weight[..., None] * change[:, None, places]
    x[..., _PLACES:] += fade(frames)[:, None] * change[:, None, _PLACES:]
    return x


def _too_far_to_walk(
    features: Float[Tensor, "*b frames 8"], stands: Float[Tensor, "2"]
) -> Bool[Tensor, "*b"]:
    """Whether there is too little time to walk around the object from a place to the first contact."""
    until = _frames_until_contact(features).amin(dim=-1)
    last = features.shape[-2] - 1
    index = until.clamp(max=last)[..., None, None].expand(*until.shape, 1, features.shape[-1])
    there = standing_position(features.gather(-2, index).squeeze(-2))
    far, near = there.norm(dim=-1), stands.norm()
    turn = torch.atan2(
        stands[0] * there[..., 1] - stands[1] * there[..., 0], (stands * there).sum(dim=-1)
    )
    way = torch.hypot(turn * (far + near) / 2, far - near)
    return way > START.free_step + START.pace * until / FPS


def _frames_until_contact(features: Float[Tensor, "*b frames 8"]) -> Int[Tensor, "*b 2"]:
    """Return the frames before each hand holds something; the longest blend where it never does."""
    holds = features[..., _PLACES:] > 0
    return torch.where(holds.any(dim=-2), holds.int().argmax(dim=-2), START.longest_blend)


def _blend(features: Float[Tensor, "*b frames 8"]) -> Int[Tensor, "*b 2"]:
    """Return the frames over which each hand's palms are blended from the start to the hypothesis."""
    return _frames_until_contact(features).clamp(START.shortest_blend, START.longest_blend)


def _palms(features: Float[Tensor, "*b 8"]) -> Float[Tensor, "*b 2 3"]:
    return features[..., :_PLACES].unflatten(-1, (2, 3))
