"""The methods of the tables, from the folders that `omocap train` writes."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

from omomo_core.generation.result import GenerationOptions
from omomo_core.learning.baselines.goal.network import build
from omomo_core.learning.evaluation.method import EvaluatedMethod
from omomo_core.learning.evaluation.methods.goal import GoalMethod
from omomo_core.learning.evaluation.methods.ours import Capture
from omomo_core.learning.evaluation.methods.published import Omomo, Palms, SingleStage
from omomo_core.stages.network_file import load_network
from omomo_core.stages.stage import load_stage
from omomo_core.weights.load import load_stages


def load_method(name: str, folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    """A method by its name, one of `LOADERS`.

    Args:
        name: which; three share the networks of `omocap train omomo`.
        folder: where its networks are.
        options: sampler and steps of those that diffuse.

    Raises:
        AssetError: networks are missing or damaged.
    """
    return LOADERS[name](folder, options)


def _omomo(palms: Palms, folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    hands, body = (load_stage(folder / f"{name}.safetensors") for name in ("hands", "body"))
    return Omomo(hands, body, palms, options)


def _single_stage(folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    return SingleStage(load_stage(folder / "single.safetensors"), options)


def _goal(folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    return GoalMethod(load_network(folder / "goal.safetensors", build))


def _capture(folder: Path, options: GenerationOptions) -> EvaluatedMethod:
    return Capture(load_stages("capture", folder), options)


LOADERS: dict[str, Callable[[Path, GenerationOptions], EvaluatedMethod]] = {
    "goal": _goal,
    "single-stage": _single_stage,
    "no-constraints": partial(_omomo, "free"),
    "omomo": partial(_omomo, "constrained"),
    "gt-hands": partial(_omomo, "true"),
    "capture": _capture,
}
