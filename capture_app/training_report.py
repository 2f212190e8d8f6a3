"""TrainingReport: what training and synthesis tell while they work."""

from collections import Counter
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.dataset import Summary


class TrainingReport:
    """Is called while `train` and `synthesise_data` work; this one keeps silent, others override it."""

    def mute(self) -> None:
        """Another process reports the same run."""

    @contextmanager
    def counting(self, label: str) -> Generator[Callable[[int, int], None]]:
        """Give what is called with (done, total) while files are read or clips are made."""
        yield lambda done, total: None

    @contextmanager
    def steps(self, network: str, total: int) -> Generator[Callable[[int, float], None]]:
        """Give what is called with (step, loss) after each step of a network's training."""
        yield lambda step, loss: None

    def left_out(self, reasons: Counter[str], details: Path | None = None) -> None:
        """Recordings were left out: how many for each reason, and a file that says which."""

    def gathered(self, clips: Sequence[Clip]) -> None:
        """These are the clips that networks are trained on."""

    def synthesised(self, data_set: Path, summary: Summary) -> None:
        """A data set is whole."""

    def interrupted(self, data_set: Path, kept: int, count: int) -> None:
        """Synthesis was interrupted; the data set holds `kept` clips of `count`."""
