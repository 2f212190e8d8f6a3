"""The methods of the tables: how they are called, which networks each needs, and those networks loaded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from omomo_core.diffusion.samplers import Sampler
from omomo_core.errors import AssetError, InputError
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.learning.evaluation.evaluated_methods import (
    LOADERS,
    EvaluatedMethod,
    RecordedPeople,
)
from omomo_core.stages.network_file import Header, read_header


@dataclass(frozen=True)
class Entry:
    """A method as the tables write it."""

    title: str
    folder: str = ""
    """Folder of its networks, in the folder of weights; "" when it has none."""
    networks: tuple[str, ...] = ()


_OMOMO = ("hands", "body")
METHODS = {
    "goal": Entry("GOAL", "goal", ("goal",)),
    "single-stage": Entry("OMOMO-single-stage", "single-stage", ("single",)),
    "no-constraints": Entry("OMOMO w/o constraints", "omomo", _OMOMO),
    "omomo": Entry("OMOMO", "omomo", _OMOMO),
    "gt-hands": Entry("OMOMO, true hands", "omomo", _OMOMO),
    "capture": Entry("omocap (capture)", "capture", _OMOMO),
    "recorded": Entry("recorded people"),
}
"""Methods by the names of the command line, in the order of the tables."""


def chosen_methods(names: Sequence[str], weights: Path | None) -> list[str]:
    """The methods to run: those asked for, or all.

    Raises:
        InputError: ``unknown-method``.
        AssetError: ``weights-missing`` when a method's networks are not there.
    """
    unknown = [name for name in names if name not in METHODS]
    if unknown:
        raise InputError(
            "unknown-method",
            f"There is no method {unknown[0]!r}.",
            field="methods",
            fix=f"Use {', '.join(METHODS)}.",
        )
    chosen = [name for name in METHODS if not names or name in names]
    for name in chosen:
        for path in _files(name, weights):
            if not path.is_file():
                raise AssetError(
                    "weights-missing",
                    f"There are no weights for {name}.",
                    where=str(path),
                    fix=f"Train them with `omocap train {METHODS[name].folder}`, or leave the method "
                    "out with ‹methods›.",
                )
    return chosen


def networks_of(name: str, weights: Path | None) -> list[Header]:
    """The networks of a method.

    Raises:
        AssetError: ``weights-damaged``.
    """
    return [read_header(path) for path in _files(name, weights)]


def folder_of(name: str, weights: Path | None) -> Path | None:
    """Return the folder of a method's networks; those of `capture` ship with the program."""
    from omomo_core.weights.load import SHIPPED

    entry = METHODS[name]
    own = weights / entry.folder if weights is not None else SHIPPED / entry.folder
    if entry.folder == "capture" and not own.is_dir():
        return SHIPPED / "capture"
    return own if entry.folder else None


def _files(name: str, weights: Path | None) -> list[Path]:
    folder = folder_of(name, weights)
    return (
        [folder / f"{network}.safetensors" for network in METHODS[name].networks] if folder else []
    )


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
        name: LOADERS[name](folder, options) if folder is not None else RecordedPeople()
        for name, folder in folders.items()
    }
