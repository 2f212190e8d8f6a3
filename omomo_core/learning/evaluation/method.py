"""What every method of the tables offers: people for the object of a window."""

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.motion import HumanMotion


@runtime_checkable
class EvaluatedMethod(Protocol):
    """A way to make people for a moving object."""

    @property
    def name(self) -> str:
        """As the tables call it."""
        ...

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """People on the bones of the clip's body, in the world; the one that it would show comes first.

        Args:
            clip: one window of 24 to 120 frames; of its truth a method uses only what its name says.
            samples: how many people (K).
            seed: of all randomness.
            first_frame: the true pose of frame 0, and the canonical frame it gives, may be used (the
                paper's protocol, OMOMO section 5.1).
        """
        ...
