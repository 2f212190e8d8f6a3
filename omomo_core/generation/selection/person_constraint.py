"""Person constraint: selection of palm hypotheses where a side, the hands or the end position are known.

The network is told where a person starts and nothing else, so hypotheses are selected that fit what is said.
Where few do, others are turned about the vertical to where the person is said to be. Which hands hold is
fixed while palms are denoised (inpainting), so that a hand that never holds goes where free hands go.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.contact.decode import HandChoice
from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.selection.plausibility import (
    Hypotheses,
    PalmHolds,
    Samples,
    standing_position,
    turned,
)
from omomo_core.generation.selection.selection_config import PERSON_CONSTRAINT, SLIDING
from omomo_core.generation.selection.start_constraint import StartPosition
from omomo_core.stages.hands_capture import LAYOUT

SideWord = Literal["front", "back", "left", "right"]
"""Side of an object, seen in the direction in which it goes."""

_AHEAD = {"front": 1.0, "left": 1j, "back": -1.0, "right": -1j}
_CONTACTS = slice(3 * LAYOUT.vectors, LAYOUT.channels)


@dataclass(frozen=True)
class PersonConstraint:
    """What is known of the person who holds the object."""

    side: SideWord | Float[np.ndarray, "2"] | None = None
    """Side on which they are while they hold it: a word, or a direction (world axes) from the object's
    centre."""
    side_frame: int = 0
    """Frame about which that direction is meant."""
    hands: HandChoice | None = None
    end: Float[Tensor, "2"] | None = None
    """Place of the pelvis in the last frame, above the floor, from the object's centre, metres."""

    @property
    def placed(self) -> bool:
        """Whether it says where the person is."""
        return self.side is not None or self.end is not None

    def fitting(self, features: Hypotheses, clip: ObjectClip, samples: int) -> Samples:
        """Return the hypotheses that fit; where too few do, those that fit least badly.

        Args:
            features: in axes whose third is up.
            clip: the object.
            samples: how many are needed at least.
        """
        if not self.placed:
            return features
        misfit = self._misfit_or_implausible(features, clip)
        if int((misfit <= 1).sum()) < samples:
            away = turned(features, -self._turn_off(features, clip))
            misfit = np.concatenate([misfit, self._misfit_or_implausible(away, clip)])
            features = torch.cat([features, away])
        most = max(1.0, float(np.sort(misfit)[min(samples, len(misfit)) - 1]))
        return features[torch.from_numpy(misfit <= most)]

    def _misfit_or_implausible(
        self, features: Samples, clip: ObjectClip
    ) -> Float[np.ndarray, " samples"]:
        plausible = PalmHolds.of(features, clip).plausible
        return self.misfit(features, clip) + PERSON_CONSTRAINT.implausible * ~plausible

    def misfit(self, features: Samples, clip: ObjectClip) -> Float[np.ndarray, " samples"]:
        """Return how far each sample is from what is said; up to 1 it fits."""
        off = np.zeros(len(features))
        if self.side is not None:
            off = np.maximum(
                off, np.abs(self._turn_off(features, clip)) / PERSON_CONSTRAINT.side_tolerance
            )
        if self.end is not None:
            last = standing_position(features[:, -1]) - self.end
            off = np.maximum(
                off, last.norm(dim=-1).double().numpy() / PERSON_CONSTRAINT.end_tolerance
            )
        return off

    def _turn_off(self, features: Samples, clip: ObjectClip) -> Float[np.ndarray, " samples"]:
        """Return the angle about the vertical from what is said to each sample, degrees."""
        place = standing_position(features).double().numpy()
        if self.side is None:
            assert self.end is not None
            return side_off(place[:, -1:], self.end.double().numpy(), clip.trained.velocity[-1:], 0)
        return side_off(place, self.side, clip.trained.velocity, self.side_frame)

    def impose_end(self, features: Samples) -> Samples:
        """Return the samples, which end at the known place or as near to it as there is time to go."""
        if self.end is None:
            return features
        return StartPosition(self.end).impose(features.flip(1)).flip(1)

    def impose_hands(
        self, features: Samples, prefix: Float[Tensor, "samples first 8"] | None
    ) -> Samples:
        """Return the samples with contacts of those hands only that may hold.

        Args:
            features: as the network predicts them.
            prefix: their first frames, where they are fixed: who began with one hand goes on with it.
        """
        if self.hands is None:
            return features
        x = features.clone()
        contact = x[..., _CONTACTS]
        if self.hands == "both":
            x[..., _CONTACTS] = contact.amax(dim=-1, keepdim=True).expand_as(contact)
        else:
            free = ~self._may_hold(len(x), prefix)
            x[..., _CONTACTS] = torch.where(free[:, None], contact.clamp(max=-1.0), contact)
        return x

    def _may_hold(
        self, samples: int, prefix: Float[Tensor, "samples first 8"] | None
    ) -> Bool[Tensor, "samples 2"]:
        right = (
            torch.arange(samples) % PERSON_CONSTRAINT.left_one_in
            != PERSON_CONSTRAINT.left_one_in - 1
        )
        if self.hands != "one":
            right = torch.full((samples,), self.hands == "right")
        elif prefix is not None:
            held = (prefix[..., _CONTACTS] > 0).sum(dim=1)
            right = torch.where(held[:, 0] == held[:, 1], right, held[:, 1] > held[:, 0])
        return torch.stack([~right, right], dim=-1)


UNKNOWN_PERSON = PersonConstraint()


def side_off(
    place: Float[np.ndarray, "samples frames 2"],
    side: SideWord | Float[np.ndarray, "2"],
    velocity: Float[np.ndarray, "frames 3"],
    middle: int,
) -> Float[np.ndarray, " samples"]:
    """Return the angle from the side of the object that is said to each sample's, degrees.

    Args:
        place: of the person, from the object's centre, metres.
        side: the one that is said, as a `PersonConstraint` has it.
        velocity: of the object's centre, world, m/s.
        middle: frame about which the side is meant, unless it is a word.
    """
    at = place[..., 0] + 1j * place[..., 1]
    if isinstance(side, str):
        way = velocity[:, 0] + 1j * velocity[:, 1]
        # Slower is noise.
        way = np.where(np.abs(way) > SLIDING.slowest, way, 0.0)
        there = (at * way.conj()).mean(axis=1) * np.conj(_AHEAD[side])
    else:
        half = PERSON_CONSTRAINT.side_frames // 2
        there = at[:, max(middle - half, 0) : middle + half + 1].mean(axis=1) * np.conj(
            complex(*side)
        )
    return np.degrees(np.angle(there))
