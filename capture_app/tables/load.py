"""The methods of the tables, ready to answer."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from capture_app.tables.methods import folder_of
from omomo_core.diffusion.samplers import Sampler
from omomo_core.generation.result import GenerationOptions
from omomo_core.learning.evaluation.method import EvaluatedMethod
from omomo_core.learning.evaluation.methods.load import RecordedPeople, load_method


def load_methods(
    names: Sequence[str], weights: Path | None, sampler: Sampler, steps: int
) -> Mapping[str, EvaluatedMethod]:
    """Methods by the names of the command line.

    Raises:
        AssetError: networks are missing or damaged.
    """
    options = GenerationOptions(sampler=sampler, steps=steps)
    folders = {name: folder_of(name, weights) for name in names}
    return {
        name: load_method(name, folder, options) if folder is not None else RecordedPeople()
        for name, folder in folders.items()
    }
