"""TrainingConsole: what training and synthesis tell, on the console."""

from collections import Counter
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from capture_app.cli.console import ProgressBars, counting, errors, output, say
from capture_app.training import TrainingReport, held_out
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.dataset import Summary
from omomo_core.motion import FPS


class TrainingConsole(TrainingReport):
    """Results go to stdout, progress to stderr."""

    def mute(self) -> None:
        """Print nothing from now on."""
        output.quiet = errors.quiet = True

    @contextmanager
    def counting(self, label: str) -> Generator[Callable[[int, int], None]]:
        """Show a bar."""
        with counting(label) as progress:
            yield progress

    @contextmanager
    def steps(self, network: str, total: int) -> Generator[Callable[[int, float], None]]:
        """Show a bar with the loss and the time left."""
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed}/{task.total}  loss {task.fields[loss]:.4f}"),
            TimeRemainingColumn(),
        )
        with ProgressBars(*columns) as bars:
            task = bars.add_task(network, total=total, loss=float("nan"))
            yield lambda step, loss: bars.update(task, completed=step, loss=loss)

    def left_out(self, reasons: Counter[str], details: Path | None = None) -> None:
        """Print a line for each reason."""
        for reason, count in reasons.most_common():
            say("left out", f"{count} x {reason}", "yellow")
        if reasons and details:
            output.print(f"Which files, and what is wrong with them: {details}")

    def gathered(self, clips: Sequence[Clip]) -> None:
        """Print how many clips there are of each source, and how long they are."""
        frames = Counter[str]()
        number = Counter(clip.source for clip in clips)
        for clip in clips:
            frames[clip.source] += len(clip.root)
        for source, count in number.most_common():
            output.print(f"{count} clips of {source}, {frames[source] / FPS / 60:.1f} min")
        if held := held_out(clips):
            text = f"{held} of the clips are of people that the paper holds out: tables on them are no test"
            say("note", text, "yellow")

    def synthesised(self, data_set: Path, summary: Summary) -> None:
        """Print what is in the data set, and what was rejected."""
        attempts = summary.clips + summary.rejected.total()
        output.print(
            f"{summary.clips} clips of {attempts} attempts, {summary.per_minute:.1f} sequences a minute"
        )
        for title, place in (("action", 0), ("object", 1)):
            minutes: dict[str, float] = {}
            for key, amount in summary.minutes.items():
                minutes[key[place]] = minutes.get(key[place], 0.0) + amount
            table = Table(title, "minutes", box=None, pad_edge=False, header_style="dim")
            for name, amount in sorted(minutes.items(), key=lambda item: -item[1]):
                table.add_row(name, f"{amount:.1f}")
            output.print(table)
        table = Table("rejected because", "attempts", "share", box=None, pad_edge=False)
        for reason, number in summary.rejected.most_common():
            table.add_row(reason, str(number), f"{100 * number / attempts:.0f} %")
        output.print(table)
        say("Done", f"{summary.clips} clips in {data_set}", "green")

    def interrupted(self, data_set: Path, kept: int, count: int) -> None:
        """Print how to go on."""
        line = f"{kept} of {count} clips are in {data_set}; the same command goes on from there."
        errors.print(line, soft_wrap=True, markup=False)
