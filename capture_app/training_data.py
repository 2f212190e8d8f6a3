"""What a training run is trained on: clips that exist, or clips made from a user's recordings.

Made clips are kept in the folder of the run, so that the same command goes on where it stopped:
``recorded.npz`` (the recordings on our skeleton), ``data.json`` (what was read, and what was left out
and why) and ``synthetic/`` (a data set of `omocap data synthesise`).
"""

import hashlib
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from capture_app.commands.train import TrainRequest
from capture_app.training_report import TrainingReport
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.recordings.clips import Clip, load_clips, read_index, save_clips
from omomo_core.learning.recordings.dataset import CARD
from omomo_core.learning.recordings.recordings import build_mocap, motion_files
from omomo_core.whole_file import write_whole

RECORDED, REPORT, SYNTHETIC = "recorded.npz", "data.json", "synthetic"


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
    clips = [source for source in sources if holds_clips(source)]
    return clips, [source for source in sources if source not in clips]


def holds_clips(source: Path) -> bool:
    """Whether `load_clips` reads it: a data set, a file of clips, or a folder of such files."""
    if source.is_dir():
        files = sorted(source.glob("*.npz"))[:1]
        return (source / CARD).is_file() or any(holds_clips(file) for file in files)
    if source.suffix.lower() != ".npz":
        return False
    try:
        read_index(source)
    except InputError:
        return False
    return True


def gather(
    sources: Sequence[Path], request: TrainRequest, body: BodyModel, report: TrainingReport
) -> list[Clip]:
    """Clips of recordings, from the run's folder when they were made before.

    Args:
        sources: files and folders of recordings.
        request: the run, and how recordings are read.
        body: whose proportions the clips get.
        report: is called with how many files were read, and what was left out.

    Raises:
        InputError: ``run-differs`` when the run was begun with other data, and as `build_mocap`.
    """
    wanted, run = _fingerprint(sources, request), request.output
    kept, card = run / RECORDED, run / REPORT
    if kept.is_file() and card.is_file():
        before = json.loads(card.read_text(encoding="utf-8"))
        if before.get("fingerprint") != wanted:
            raise InputError(
                "run-differs",
                "This run was begun with other recordings, or they have changed.",
                where=str(run),
                fix="Give another folder with -o.",
            )
        dropped = Counter[str](before["left_out"])
    else:
        dropped = _record(sources, request, body, report, wanted)
    report.left_out(dropped, card)
    # As they will be read when the run goes on, to the last bit.
    return load_clips(kept)


def _record(
    sources: Sequence[Path],
    request: TrainRequest,
    body: BodyModel,
    report: TrainingReport,
    fingerprint: str,
) -> Counter[str]:
    """Write the clips of recordings and what became of each file; returns what was left out."""
    clips, dropped = list[Clip](), Counter[str]()
    problems: list[InputError] = []
    for source in sources:
        with report.counting(f"read {source.name}") as progress:
            clips += build_mocap(
                source,
                body,
                share_alike=request.share_alike,
                progress=progress,
                dropped=dropped,
                skipped=problems,
                metres_per_unit=request.metres_per_unit,
                object_split=request.object_split,
            )
    request.output.mkdir(parents=True, exist_ok=True)
    save_clips(request.output / RECORDED, clips)
    card = {
        "fingerprint": fingerprint,
        "sources": [str(s) for s in sources],
        "clips": len(clips),
        "with_objects": sum(c.object_motion is not None for c in clips),
        "left_out": dict(dropped.most_common()),
        "problems": [str(p) for p in problems],
    }
    write_whole(request.output / REPORT, json.dumps(card, indent=2) + "\n")
    return dropped


def _fingerprint(sources: Sequence[Path], request: TrainRequest) -> str:
    """The same for the same files, read the same way."""
    # The words are those that runs of earlier versions were begun with.
    reading = (
        f"RecordingOptions(share_alike={request.share_alike!r}, "
        f"metres_per_unit={request.metres_per_unit!r}, object_split={request.object_split!r})"
    )
    seen = hashlib.sha256(reading.encode())
    for source in sources:
        for file in motion_files(source):
            seen.update(f"{file.name} {file.stat().st_size} {file.stat().st_mtime_ns}".encode())
    return seen.hexdigest()[:16]
