"""A data set of synthetic clips: a folder of whole files, so that an interrupted run can resume.

The folder holds ``dataset.json`` (how it was made), ``recorded.npz`` (the mocap it was made from) and
``clips_00000.npz``, ``clips_00001.npz``... of 100 clips each; `load_clips` reads the folder.
"""

import hashlib
import json
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from omomo_core.errors import InputError
from omomo_core.learning.recordings.clips import Clip, read_index, save_clips
from omomo_core.motion import FPS
from omomo_core.whole_file import write_whole

SHARD = 100
"""Clips in a file: lost at most when a run is killed."""
CARD, RECORDED = "dataset.json", "recorded.npz"


@dataclass(frozen=True)
class DatasetRecipe:
    """Everything that determines the clips of a data set; their number may grow."""

    seed: int
    version: int
    """Version of the program that makes clips."""
    mocap: str
    """Digest of the recorded motion."""
    people: str = "1-17"
    objects: str = "all"
    """Objects as the roster says them."""
    shard: int = SHARD


@dataclass(frozen=True)
class Summary:
    """What is in a data set and what it took to make."""

    clips: int = 0
    seconds: float = 0.0
    """Seconds of computing, over all runs."""
    rejected: Counter[str] = field(default_factory=Counter)
    """Attempts that were thrown away, by reason."""
    minutes: dict[tuple[str, str], float] = field(default_factory=dict)
    """Minutes of motion, by action and object."""
    licences: Counter[str] = field(default_factory=Counter)
    """Clips under each licence."""

    @property
    def per_minute(self) -> float:
        """Clips made in a minute."""
        return 60.0 * self.clips / self.seconds if self.seconds else 0.0


def digest(clips: Sequence[Clip]) -> str:
    """Return a digest of recorded motion, equal in memory and when read from a file."""
    seen = hashlib.sha256()
    for clip in clips:
        seen.update(clip.name.encode())
        for array in (clip.root, clip.rotations):
            seen.update(np.ascontiguousarray(array, np.float32).tobytes())
    return seen.hexdigest()[:16]


def open_dataset(folder: Path, recipe: DatasetRecipe, recorded: Sequence[Clip]) -> None:
    """Start a data set, or check that the one in the folder can be resumed.

    Raises:
        InputError: ``dataset-differs`` when the clips in it were made otherwise; ``output-exists``
            when the folder holds something else.
    """
    card = folder / CARD
    if not card.is_file():
        if folder.is_dir() and any(folder.iterdir()):
            raise InputError(
                "output-exists",
                "The folder for the data set is not empty and holds no data set.",
                where=str(folder),
                fix="Give a new folder with ‹output›.",
            )
        folder.mkdir(parents=True, exist_ok=True)
        write_card(folder, recipe)
    _check_same(card, recipe)
    if not (folder / RECORDED).is_file():
        save_clips(folder / RECORDED, recorded)


def _check_same(card: Path, recipe: DatasetRecipe) -> None:
    try:
        before = json.loads(card.read_text(encoding="utf-8"))["recipe"]
        # A data set that does not say them was made before there was a choice.
        open_to_choice = {"people": "1-17", "objects": "all"}
        before, now = {**open_to_choice, **before}, asdict(recipe)
        names = {"version": "recipe", "mocap": "recorded motion", "shard": "size"}
        differ = [k for k in {**now, **before} if before.get(k) != now.get(k)]
        other = [
            f"{names.get(k, k)} {_said(before.get(k))}, not {_said(now.get(k))}" for k in differ
        ]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            "dataset-damaged",
            "The description of the data set cannot be read.",
            where=str(card),
            fix="Make the data set again in a new folder.",
        ) from error
    if other:
        raise InputError(
            "dataset-differs",
            f"The clips in this folder were made otherwise: {'; '.join(other)}.",
            where=str(card),
            fix="Give the options it was made with, or a new folder with ‹output›.",
        )


def _said(value: object) -> str:
    return "none" if value is None else str(value)


def missing_indices(folder: Path, count: int) -> list[int]:
    """Return the indices of the clips that are missing, whole files of them.

    Raises:
        InputError: ``dataset-larger`` when the folder holds more than `count` clips.
    """
    held = {int(file.stem.rpartition("_")[2]): len(read_index(file)[0]) for file in shards(folder)}
    if sum(held.values()) > count or any(k * SHARD >= count for k in held):
        raise InputError(
            "dataset-larger",
            f"The folder holds {sum(held.values())} clips, more than {count} are.",
            where=str(folder),
            fix="Give a larger ‹count›, or a new folder with ‹output›.",
        )
    indices: list[int] = []
    for k, first in enumerate(range(0, count, SHARD)):
        wanted = range(first, min(first + SHARD, count))
        # A last file that was shorter is made again when the data set grows.
        indices += wanted if held.get(k, 0) < len(wanted) else []
    return indices


def shards(folder: Path) -> list[Path]:
    """The files of synthetic clips, in order."""
    return sorted(folder.glob("clips_*.npz"))


def write_shards(
    folder: Path, indices: Sequence[int], clips: Iterable[Clip], rejected: Counter[str]
) -> Iterator[Path]:
    """Write clips as they come, a file at a time, and yield each finished file.

    Args:
        folder: of the data set.
        indices: of the clips, from `missing_indices`.
        clips: one for each index.
        rejected: counts what was thrown away, and is up to date with every clip.
    """
    held: list[Clip] = []
    start, before = time.perf_counter(), Counter(rejected)
    ends = {*indices[-1:], *(a for a, b in pairwise(indices) if _ends(a, b))}
    for index, clip in zip(indices, clips, strict=True):
        held.append(clip)
        if index not in ends:
            continue
        notes = {"rejected": rejected - before, "seconds": time.perf_counter() - start}
        file = folder / f"clips_{index // SHARD:05d}.npz"
        save_clips(file, held, notes)
        held, start, before = [], time.perf_counter(), Counter(rejected)
        yield file


def _ends(index: int, following: int) -> bool:
    return index // SHARD != following // SHARD


def summarise(folder: Path) -> Summary:
    """Add up what the files of a data set say about themselves."""
    clips, seconds = 0, 0.0
    rejected, licences = Counter[str](), Counter[str]()
    minutes: dict[tuple[str, str], float] = defaultdict(float)
    for file in shards(folder):
        rows, notes = read_index(file)
        clips += len(rows)
        seconds += notes.get("seconds", 0.0)
        rejected.update(notes.get("rejected", {}))
        for row in rows:
            licences[row["licence"]] += 1
            minutes[action_of(row["name"]), row["object"] or ""] += row["frames"] / FPS / 60.0
    return Summary(clips, seconds, rejected, minutes, licences)


def action_of(name: str) -> str:
    """The action of a synthetic clip, whose name says who moves what, a space, and how."""
    words = name.split()
    return words[1] if len(words) > 1 else ""


def write_card(folder: Path, recipe: DatasetRecipe) -> Summary:
    """Describe the data set in its folder, as it stands now."""
    summary = summarise(folder)
    card = {
        "recipe": asdict(recipe),
        "clips": summary.clips,
        "seconds": round(summary.seconds, 1),
        "rejected": dict(summary.rejected.most_common()),
        "licences": dict(summary.licences),
    }
    write_whole(folder / CARD, json.dumps(card, indent=2) + "\n")
    return summary
