"""Arrays of the files of a result folder that hold motion, and which of its samples are solved.

Nothing here loads torch: a server asks, too.
"""

from collections.abc import Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from capture_app.manifest import MOTION
from omomo_core.array_archive import read_arrays
from omomo_core.errors import InputError, in_words, reading

SAMPLED = "sampled.npz"
"""File of what all samples are solved from; a result of which everything is solved has none."""


def unsolved_samples(folder: Path) -> frozenset[int]:
    """Indices of the samples of a result folder that are as they were sampled.

    Raises:
        InputError: "result-missing" or "result-damaged".
    """
    if not (folder / SAMPLED).is_file():
        return frozenset()
    with reading_motion(folder / MOTION):
        solved = read_arrays(folder / MOTION, lambda name: name == "solved")["solved"]
    rough = np.flatnonzero(~solved).tolist()
    return frozenset(k for k in rough if not sample_file(folder, k).is_file())


def sample_file(folder: Path, index: int) -> Path:
    """The file of a sample that was solved after the run, in a result folder."""
    return folder / f"sample_{index + 1}.npz"


@contextmanager
def reading_motion(path: Path) -> Generator[None]:
    """Turn whatever is raised while a file of motion is read into one error.

    Raises:
        InputError: "result-missing" or "result-damaged".
    """
    # Damaged bytes fail in a dozen ways in zipfile, zlib and numpy.
    with reading(partial(damaged, path), words=in_words):
        try:
            yield
        except FileNotFoundError as error:
            raise InputError(
                "result-missing",
                "The result folder has no motion in it.",
                where=str(path),
                fix="Run the take again.",
            ) from error


def damaged(path: Path, why: str) -> InputError:
    """The error for a motion that cannot be read."""
    return InputError(
        "result-damaged",
        f"The motion cannot be read: {why}.",
        where=str(path),
        fix="Run the take again.",
    )
