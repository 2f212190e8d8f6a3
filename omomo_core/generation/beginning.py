"""Guesses of somebody of whom it is known where they stand at first, or how.

Where somebody is before they take something tells from which side it is taken, more than the object does.
So many guesses are made, each from all the sides that it can be made from; those are kept that begin most
like what is known, and they go from it to what they hold.
"""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float, Int
from torch import Tensor

from omomo_core.generation.cover import cover
from omomo_core.generation.decided import fade
from omomo_core.generation.opposite import across, beyond, graspable
from omomo_core.generation.scene import Scene
from omomo_core.motion import FPS

NEAR, FEWEST = 1.5, 4
"""Candidates among which the samples are chosen: so many for each, at least."""
SHORTEST, LONGEST = 10, 60
"""Frames in which palms come from where they are known to be to where they were guessed."""
FASTEST = 1.8
"""Metres a second at which somebody comes to where they were guessed to be."""
BEFORE, BESIDE = 0.4, 0.1
"""From the pelvis to the middle of the palms, that hold something or do not; metres ahead."""
_PLACES = 6

Samples = Float[Tensor, "samples frames 8"]
First = Float[Tensor, "*b 8"]


@dataclass(frozen=True)
class Posed:
    """The palms of the first frame."""

    first: Float[Tensor, "8"]
    """As a guess has them: from the object's centre, and contacts."""

    def off(self, first: First) -> Float[Tensor, "*b"]:
        """Mean distance of the palms of guesses that begin with these features, metres."""
        return _palms(first - self.first).norm(dim=-1).mean(dim=-1)

    def moved(self, features: Samples) -> Samples:
        """The guesses, beginning with exactly these palms."""
        return begin(features, self.first)


@dataclass(frozen=True)
class Placed:
    """Where somebody stands."""

    place: Float[Tensor, "2"]
    """On the floor, from the object's centre, metres."""

    def off(self, first: First) -> Float[Tensor, "*b"]:
        """Distance on the floor of guesses that begin with these features, metres."""
        return (_stands(first) - self.place).norm(dim=-1)

    def moved(self, features: Samples) -> Samples:
        """The guesses from there, or from as near to it as there is time to come from."""
        way = self.place - _stands(features[:, 0])
        time = _until_held(features).amin(dim=-1).clamp(max=LONGEST) / FPS
        # The fade is 1.5 times as fast in its middle as on the whole.
        far = FASTEST / 1.5 * time
        way = way * (far / way.norm(dim=-1).clamp(min=1e-6)).clamp(max=1)[:, None]
        first = features[:, 0].clone()
        for hand in (0, 1):
            first[:, 3 * hand : 3 * hand + 2] += way
        return begin(features, first)


Start = Posed | Placed
"""What is known of the first frame."""


@dataclass(frozen=True)
class LikeStart:
    """Guesses that begin most like what is known."""

    kept: Int[Tensor, " samples"]
    """Which."""
    side: Int[Tensor, " samples"]
    """The side from which each is made."""
    start: Start

    @staticmethod
    def choose(features: Samples, start: Start, scene: Scene, samples: int) -> "LikeStart":
        """Of those that begin most like it the ones that stand for all that do.

        Args:
            features: of all guesses, palms from the object's centre in axes whose third is up, contacts.
            start: what is known.
            scene: the object.
            samples: how many to keep.
        """
        sides = _sides(features)
        off = start.off(sides[:, :, 0])
        off[1, torch.from_numpy(~graspable(sides[1], features, scene))] = torch.inf
        count = max(math.ceil(NEAR * samples), FEWEST)
        near = off.flatten().argsort(stable=True)[:count]
        places = _palms(sides.flatten(0, 1)[near]).double().numpy()
        kept = near[torch.from_numpy(cover(places, samples))]
        return LikeStart(kept % len(features), kept // len(features), start)

    def finished(self, features: Samples) -> Samples:
        """The guesses that are kept, once they are drawn to the end: from their sides and the start."""
        each = torch.arange(len(features))
        return self.start.moved(_sides(features)[self.side, each])


def begin(features: Samples, first: Float[Tensor, "*samples 8"]) -> Samples:
    """Guesses that begin so; each hand is where it was guessed to be once it holds something."""
    frames = features.shape[1]
    x = features.clone()
    change = first - features[:, 0]
    until = _until_held(features).clamp(SHORTEST, LONGEST)
    for hand in (0, 1):
        places = slice(3 * hand, 3 * hand + 3)
        weight = torch.stack([fade(frames, int(u)) for u in until[:, hand]])
        x[..., places] += weight[..., None] * change[:, None, places]
    x[..., _PLACES:] += fade(frames)[:, None] * change[:, None, _PLACES:]
    return x


def _until_held(features: Samples) -> Int[Tensor, "samples 2"]:
    """Frames before each hand holds something; LONGEST where it never does."""
    holds = features[..., _PLACES:] > 0
    return torch.where(holds.any(dim=1), holds.int().argmax(dim=1), LONGEST)


def _stands(first: First) -> Float[Tensor, "*b 2"]:
    """Where somebody stands whose palms are so, from the object's centre."""
    left, right = _palms(first)[..., :2].unbind(dim=-2)
    across_body = left - right
    ahead = torch.stack([across_body[..., 1], -across_body[..., 0]], dim=-1)
    ahead = ahead / ahead.norm(dim=-1, keepdim=True).clamp(min=1e-6)
    holds = (first[..., _PLACES:] > 0).any(dim=-1, keepdim=True)
    return (left + right) / 2 - torch.where(holds, BEFORE, BESIDE) * ahead


def _sides(features: Samples) -> Float[Tensor, "sides samples frames 8"]:
    return torch.stack([features, across(features), beyond(features)])


def _palms(features: Float[Tensor, "*b 8"]) -> Float[Tensor, "*b 2 3"]:
    return features[..., :_PLACES].unflatten(-1, (2, 3))
