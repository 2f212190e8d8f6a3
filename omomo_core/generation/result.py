"""Options and result of the generator."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from omomo_core.diffusion.samplers import Sampler
from omomo_core.generation.person import Person
from omomo_core.motion import HumanMotion

Progress = Callable[[str, float], None]
"""Progress callback: name of the step, fraction done."""


def no_progress(step: str, fraction: float) -> None:
    """Ignore the progress."""


@dataclass(frozen=True)
class GenerationOptions:
    """Options of the generator: samples, seed, contact rule, sampler and its steps."""

    samples: int = 4
    seed: int = 0
    contact: Literal["segments", "paper"] = "segments"
    sampler: Sampler = "dpm++"
    steps: int = 10


@dataclass(frozen=True)
class Generation:
    """K samples with their scores."""

    people: tuple[Person, ...]
    chosen: int
    """Index of the sample to show: central among the samples, with few faults."""
    scores: tuple[dict[str, float], ...]
    notes: tuple[str, ...]
    """Faults of the chosen sample, in sentences."""

    @property
    def motions(self) -> tuple[HumanMotion, ...]:
        """The samples' bodies."""
        return tuple(person.human for person in self.people)


def notes_of(scores: dict[str, float]) -> tuple[str, ...]:
    """Return the faults of a sample that its user should know of, in sentences."""
    faults = (
        (
            "unheld",
            0.05,
            "no hand is on the object in {:.0%} of the frames in which it must be held",
        ),
        ("miss_cm", 1.0, "the palms miss the object by {:.1f} cm on average while holding it"),
        ("inside_cm", 1.0, "the body without hands is {:.1f} cm inside the object on average"),
        ("hands_inside_cm", 1.0, "holding hands are {:.1f} cm inside the object on average"),
        ("wrists_beyond", 0.1, "holding wrists are bent too far in {:.0%} of the frames"),
    )
    return tuple(text.format(scores[key]) for key, limit, text in faults if scores[key] > limit)
