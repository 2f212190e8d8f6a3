"""The folders of a study: one for each method, with a result or recorded clip for each take."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from capture_app.manifest import MANIFEST
from omomo_core.errors import InputError


@dataclass(frozen=True)
class Method:
    """A method's motions."""

    name: str
    takes: dict[str, Path]
    """Result folder, or npz file of a recorded clip, of each take by its name."""


def read_methods(folders: Sequence[Path]) -> list[Method]:
    """What is in the methods' folders; each method is called as its folder.

    Raises:
        InputError: fewer than two, one without a motion, two of one name, or no take in common.
    """
    methods = [_method(folder) for folder in folders]
    names = [m.name for m in methods]
    if len(methods) < 2 or len(set(names)) < len(names):
        raise InputError(
            "study-methods",
            "A study needs two or more methods whose folders have different names.",
            where=", ".join(map(str, folders)),
            fix="Give a folder for each method; rename those that are called the same.",
        )
    if not common_takes(methods):
        few = "; ".join(f"{m.name}: {', '.join(list(m.takes)[:3])}..." for m in methods)
        raise InputError(
            "study-no-common-take",
            "No take is in the folders of all methods.",
            where=few,
            fix="Name the results of one take the same in each folder.",
        )
    return methods


def common_takes(methods: Sequence[Method]) -> list[str]:
    """Names of the takes that every method has, sorted."""
    return sorted(set.intersection(*(set(m.takes) for m in methods)))


def _method(folder: Path) -> Method:
    inside = sorted(folder.iterdir()) if folder.is_dir() else []
    results = {p.name: p for p in inside if (p / MANIFEST).is_file()}
    clips = {p.stem: p for p in inside if p.suffix == ".npz" and p.is_file()}
    if not results and not clips:
        raise InputError(
            "study-no-motions",
            "There is no result and no recorded clip in this folder.",
            where=str(folder),
            fix="Give a folder that holds the result folders of one method.",
        )
    return Method(folder.resolve().name, {**clips, **results})
