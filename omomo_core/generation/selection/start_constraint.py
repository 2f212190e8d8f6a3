"""Guesses of somebody of whom it is known where they stand at first, or how.

Where somebody is before they take something tells from which side it is taken, more than the object does.
So many guesses are made, each from all the sides that it can be made from; those are kept that begin most
like what is known, and they go from it to what they hold.
"""

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.prefix import fade
from omomo_core.generation.selection.coverage import k_medoids, kernel_mean
from omomo_core.generation.selection.opposite_side import half_turn, swap_hands
from omomo_core.generation.selection.plausibility import Hypotheses, PalmHolds, Samples
from omomo_core.motion import FPS

NEAR, FEWEST = 1.5, 4
"""Candidates among which the samples are chosen: so many for each, at least."""
SHORTEST, LONGEST = 10, 60
"""Frames in which palms come from where they are known to be to where they were guessed."""
FASTEST = 1.8
"""Metres a second at which somebody comes to where they were guessed to be."""
PACE, STEP = 0.8, 0.3
"""Metres a second, on the whole, at which people go around a thing before they take it, from a stand to a
stand; metres that take no time, because they lean and step while they reach."""
BEFORE, BESIDE = 0.4, 0.1
"""From the pelvis to the middle of the palms, that hold something or do not; metres ahead."""
_PLACES = 6

First = Float[Tensor, "*b 8"]


@dataclass(frozen=True)
class StartPose:
    """The palms of the first frame."""

    first: Float[Tensor, "8"]
    """As a guess has them: from the object's centre, and contacts."""

    @property
    def position(self) -> Float[Tensor, "2"]:
        """Where, on the floor, from the object's centre, metres."""
        return _standing_position(self.first)

    def distance(self, first: First) -> Float[Tensor, "*b"]:
        """Mean distance of the palms of guesses that begin with these features, metres."""
        return _palms(first - self.first).norm(dim=-1).mean(dim=-1)

    def impose(self, features: Samples) -> Samples:
        """The guesses, beginning with exactly these palms."""
        return impose_start(features, self.first)


@dataclass(frozen=True)
class StartPosition:
    """Where somebody stands."""

    position: Float[Tensor, "2"]
    """On the floor, from the object's centre, metres."""

    def distance(self, first: First) -> Float[Tensor, "*b"]:
        """Distance on the floor of guesses that begin with these features, metres."""
        return (_standing_position(first) - self.position).norm(dim=-1)

    def impose(self, features: Samples) -> Samples:
        """The guesses from there, or from as near to it as there is time to come from."""
        way = self.position - _standing_position(features[:, 0])
        time = _frames_until_contact(features).amin(dim=-1).clamp(max=LONGEST) / FPS
        # The fade is 1.5 times as fast in its middle as on the whole.
        far = FASTEST / 1.5 * time
        way = way * (far / way.norm(dim=-1).clamp(min=1e-6)).clamp(max=1)[:, None]
        first = features[:, 0].clone()
        for hand in (0, 1):
            first[:, 3 * hand : 3 * hand + 2] += way
        return impose_start(features, first)


StartConstraint = StartPose | StartPosition
"""What is known of the first frame."""


def select_by_start(
    features: Hypotheses, start: StartConstraint, clip: ObjectClip, samples: int
) -> Samples:
    """Of guesses that begin most like what is known the ones that stand for all that do, beginning so.

    Who would have to run around the object, or holds it as nobody would, counts only where all do.

    Args:
        features: of all guesses, palms from the object's centre in axes whose third is up, contacts.
        start: what is known.
        clip: the object.
        samples: how many to keep.
    """
    sides = _from_all_sides(kernel_mean(features))
    off = start.distance(sides[:, :, 0])
    likely = torch.from_numpy(np.stack([PalmHolds.of(side, clip).plausible for side in sides]))
    likely &= ~_too_far_to_walk(sides, start.position)
    off[~likely] += off.max() + 1
    count = max(math.ceil(NEAR * samples), FEWEST)
    count = min(count, max(int(likely.sum()), samples))
    near = off.flatten().argsort(stable=True)[:count]
    hypotheses = sides.flatten(0, 1)[near]
    kept = torch.from_numpy(k_medoids(_palms(hypotheses).double().numpy(), samples))
    return start.impose(hypotheses[kept])


def impose_start(features: Samples, first: Float[Tensor, "*samples 8"]) -> Samples:
    """Guesses that begin so; each hand is where it was guessed to be once it holds something."""
    frames = features.shape[1]
    x = features.clone()
    change = first - features[:, 0]
    until = _frames_until_contact(features).clamp(SHORTEST, LONGEST)
    for hand in (0, 1):
        places = slice(3 * hand, 3 * hand + 3)
        weight = torch.stack([fade(frames, int(u)) for u in until[:, hand]])
        x[..., places] += weight[..., None] * change[:, None, places]
    x[..., _PLACES:] += fade(frames)[:, None] * change[:, None, _PLACES:]
    return x


def _too_far_to_walk(
    features: Float[Tensor, "*b frames 8"], stands: Float[Tensor, "2"]
) -> Bool[Tensor, "*b"]:
    """Whether there is too little time to walk around the object from a place to what is held first."""
    until = _frames_until_contact(features).amin(dim=-1)
    last = features.shape[-2] - 1
    index = until.clamp(max=last)[..., None, None].expand(*until.shape, 1, features.shape[-1])
    there = _standing_position(features.gather(-2, index).squeeze(-2))
    far, near = there.norm(dim=-1), stands.norm()
    turn = torch.atan2(
        stands[0] * there[..., 1] - stands[1] * there[..., 0], (stands * there).sum(dim=-1)
    )
    way = torch.hypot(turn * (far + near) / 2, far - near)
    return way > STEP + PACE * until / FPS


def _frames_until_contact(features: Float[Tensor, "*b frames 8"]) -> Int[Tensor, "*b 2"]:
    """Frames before each hand holds something; LONGEST where it never does."""
    holds = features[..., _PLACES:] > 0
    return torch.where(holds.any(dim=-2), holds.int().argmax(dim=-2), LONGEST)


def _standing_position(first: First) -> Float[Tensor, "*b 2"]:
    """Where somebody stands whose palms are so, from the object's centre."""
    left, right = _palms(first)[..., :2].unbind(dim=-2)
    across_body = left - right
    ahead = torch.stack([across_body[..., 1], -across_body[..., 0]], dim=-1)
    ahead = ahead / ahead.norm(dim=-1, keepdim=True).clamp(min=1e-6)
    holds = (first[..., _PLACES:] > 0).any(dim=-1, keepdim=True)
    return (left + right) / 2 - torch.where(holds, BEFORE, BESIDE) * ahead


def _from_all_sides(features: Samples) -> Float[Tensor, "sides samples frames 8"]:
    return torch.stack([features, half_turn(features), swap_hands(features)])


def _palms(features: Float[Tensor, "*b 8"]) -> Float[Tensor, "*b 2 3"]:
    return features[..., :_PLACES].unflatten(-1, (2, 3))
