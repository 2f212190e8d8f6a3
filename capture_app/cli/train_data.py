"""The first half of `omocap train`: from what the user has to clips, told on the console."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from capture_app.cli.console import errors, output, say
from capture_app.training_data import RECORDED, SYNTHETIC, RecordingOptions, gather, split
from omomo_core.body.load import load_body
from omomo_core.learning.recordings.build import Progress
from omomo_core.learning.recordings.clips import Clip, load_clips
from omomo_core.learning.recordings.dataset import shards
from omomo_core.learning.recordings.splits import by_side
from omomo_core.learning.training.team import Team

DEFAULT_SYNTHETIC = 4200


def shared_clips(
    sources: Sequence[Path],
    run: Path,
    reading: RecordingOptions,
    team: Team,
    *,
    synthetic: int | None,
    seed: int,
    workers: int,
) -> list[Clip]:
    """`training_clips` for processes that train together: the first makes them, the others read.

    Raises:
        InputError: as `training_clips`.
    """
    if not team.leads:
        output.quiet = errors.quiet = True
        team.wait()
    clips = training_clips(sources, run, reading, synthetic=synthetic, seed=seed, workers=workers)
    if team.leads:
        team.wait()
    return clips


def training_clips(
    sources: Sequence[Path],
    run: Path,
    reading: RecordingOptions,
    *,
    synthetic: int | None,
    seed: int,
    workers: int,
) -> list[Clip]:
    """Load clips, make those of recordings, and synthesise from recordings what was asked for.

    Raises:
        InputError: as `split`, `gather`, `load_clips` and the synthesis.
    """
    ready, recordings = split(sources)
    clips = [clip for source in ready for clip in load_clips(source)]
    if recordings:
        clips += _recorded(recordings, run, reading)
        objects = any(clip.object_motion for clip in clips)
        count = (0 if objects else DEFAULT_SYNTHETIC) if synthetic is None else synthetic
        if count > 0:
            clips += _synthesised(run, count, seed, workers)
    _tell(clips)
    return clips


def _recorded(recordings: Sequence[Path], run: Path, reading: RecordingOptions) -> list[Clip]:
    from rich.progress import Progress as Bars

    with Bars(console=errors, disable=not errors.is_terminal) as bars:

        def bar(source: Path) -> Progress:
            task = bars.add_task(f"read {source.name}", total=None)
            return lambda done, total: bars.update(task, completed=done, total=total)

        found = gather(recordings, run, load_body(), reading, bar)
    for reason, count in found.dropped.most_common():
        say("left out", f"{count} x {reason}", "yellow")
    if found.dropped:
        output.print(f"Which files, and what is wrong with them: {run / 'data.json'}")
    return found.clips


def _synthesised(run: Path, count: int, seed: int, workers: int) -> list[Clip]:
    from capture_app.cli.data_synthesise import synthesise

    folder = run / SYNTHETIC
    synthesise(run / RECORDED, folder, count, seed, workers)
    return [clip for file in shards(folder) for clip in load_clips(file)]


def _tell(clips: Sequence[Clip]) -> None:
    """How many clips there are of each source, and how long they are."""
    frames = Counter[str]()
    number = Counter(clip.source for clip in clips)
    for clip in clips:
        frames[clip.source] += len(clip.root)
    for source, count in number.most_common():
        output.print(f"{count} clips of {source}, {frames[source] / 30 / 60:.1f} min")
    if held := held_out(clips):
        text = f"{held} of the clips are of people that the paper holds out: tables on them are no test"
        say("note", text, "yellow")


def held_out(clips: Sequence[Clip]) -> int:
    """How many clips are of the paper's held-out people."""
    sides = by_side(clip.name for clip in clips)
    return len(sides.get("seen", ())) + len(sides.get("unseen", ()))
