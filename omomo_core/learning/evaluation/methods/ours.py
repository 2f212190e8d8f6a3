"""Our own generator as a method of the tables."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from omomo_core.generation.conditioning import UNCONDITIONED, Conditioning, Pose
from omomo_core.generation.generator import generate
from omomo_core.generation.result import GenerationOptions
from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.motion import HumanMotion
from omomo_core.stages.stage import Stages

DEFAULT = GenerationOptions()


@dataclass(frozen=True)
class Capture:
    """The `capture` configuration with everything that `omocap run` does after its networks."""

    stages: Stages
    options: GenerationOptions = DEFAULT
    """Sampler and steps."""
    name: str = "omocap"

    def sample(
        self, clip: RealClip, samples: int, seed: int, *, first_frame: bool
    ) -> Sequence[HumanMotion]:
        """See `Method`."""
        known = (
            Conditioning(start_pose=Pose(clip.root[0], clip.rotations[0]))
            if first_frame
            else UNCONDITIONED
        )
        options = replace(self.options, samples=samples, seed=seed)
        people = generate(clip.motion, clip.body, self.stages, options, _silent, known)
        others = (m for k, m in enumerate(people.motions) if k != people.chosen)
        return [people.motions[people.chosen], *others]


def _silent(step: str, done: float) -> None:
    """Methods do not report their steps."""
