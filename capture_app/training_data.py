"""What a training run is trained on: clips that exist, or clips made from a user's recordings.

Made clips are kept in the folder of the run, so that the same command goes on where it stopped:
``recorded.npz`` (the recordings on our skeleton), ``data.json`` (what was read, and what was left out
and why) and ``synthetic/`` (a data set of `omocap data synthesise`).
"""

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.recordings.build import Progress, build_mocap
from omomo_core.learning.recordings.clips import Clip, load_clips, read_index, save_clips
from omomo_core.learning.recordings.dataset import CARD
from omomo_core.learning.recordings.recordings import motion_files
from omomo_core.whole_file import write_whole

RECORDED, REPORT, SYNTHETIC = "recorded.npz", "data.json", "synthetic"


@dataclass(frozen=True)
class RecordingOptions:
    """How recordings are read."""

    share_alike: bool
    metres_per_unit: float
    """Of BVH files."""
    object_split: bool = False
    """Of the release's files only the paper's ten objects."""


@dataclass(frozen=True)
class Gathered:
    """Clips of recordings, and what was left out."""

    clips: list[Clip]
    dropped: Counter[str] = field(default_factory=Counter)
    """How many files or sequences were left out, by reason."""


def split(sources: Sequence[Path]) -> tuple[list[Path], list[Path]]:
    """Which of the sources are clips already, and which are recordings.

    Raises:
        InputError: ``no-training-data`` when one is not there.
    """
    for source in sources:
        if not source.exists():
            raise InputError(
                "no-training-data",
                "The training data is not there.",
                where=str(source),
                fix="Give clips, a data set, or a folder of recordings.",
            )
    clips = [source for source in sources if _holds_clips(source)]
    return clips, [source for source in sources if source not in clips]


def _holds_clips(source: Path) -> bool:
    """Whether `load_clips` reads it: a data set, a file of clips, or a folder of such files."""
    if source.is_dir():
        files = sorted(source.glob("*.npz"))[:1]
        return (source / CARD).is_file() or any(_holds_clips(file) for file in files)
    if source.suffix.lower() != ".npz":
        return False
    try:
        read_index(source)
    except InputError:
        return False
    return True


def gather(
    sources: Sequence[Path],
    run: Path,
    body: BodyModel,
    reading: RecordingOptions,
    progress: Callable[[Path], Progress],
) -> Gathered:
    """Clips of recordings, from the run's folder when they were made before.

    Args:
        sources: files and folders of recordings.
        run: the folder of the run.
        body: whose proportions the clips get.
        reading: how to read them.
        progress: gives what is told about each source's files.

    Raises:
        InputError: ``run-differs`` when the run was begun with other data, and as `build_mocap`.
    """
    wanted = _fingerprint(sources, reading)
    kept, report = run / RECORDED, run / REPORT
    if kept.is_file() and report.is_file():
        before = json.loads(report.read_text())
        if before.get("fingerprint") != wanted:
            raise InputError(
                "run-differs",
                "This run was begun with other recordings, or they have changed.",
                where=str(run),
                fix="Give another folder with -o.",
            )
        return Gathered(load_clips(kept), Counter(before["left_out"]))
    clips, dropped = list[Clip](), Counter[str]()
    problems: list[InputError] = []
    for source in sources:
        clips += build_mocap(
            source,
            body,
            share_alike=reading.share_alike,
            progress=progress(source),
            dropped=dropped,
            skipped=problems,
            metres_per_unit=reading.metres_per_unit,
            object_split=reading.object_split,
        )
    run.mkdir(parents=True, exist_ok=True)
    save_clips(kept, clips)
    told = {
        "fingerprint": wanted,
        "sources": [str(s) for s in sources],
        "clips": len(clips),
        "with_objects": sum(c.object_motion is not None for c in clips),
        "left_out": dict(dropped.most_common()),
        "problems": [str(p) for p in problems],
    }
    write_whole(report, json.dumps(told, indent=2) + "\n")
    # As they will be read when the run goes on, to the last bit.
    return Gathered(load_clips(kept), dropped)


def _fingerprint(sources: Sequence[Path], reading: RecordingOptions) -> str:
    """The same for the same files, read the same way."""
    seen = hashlib.sha256(repr(reading).encode())
    for source in sources:
        for file in motion_files(source):
            seen.update(f"{file.name} {file.stat().st_size} {file.stat().st_mtime_ns}".encode())
    return seen.hexdigest()[:16]
