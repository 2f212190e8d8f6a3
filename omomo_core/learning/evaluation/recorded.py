"""The recorded people themselves as a method: what the measures give for the truth."""

from collections.abc import Sequence

from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.learning.evaluation.truth import recorded_person
from omomo_core.motion import HumanMotion


class RecordedPeople:
    """Answers with the truth: the bound of every error, and people's own sliding and collisions."""

    name = "recorded people"

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """The recorded person, once."""
        del samples, seed, first_frame
        return [recorded_person(clip, clip.body)]
