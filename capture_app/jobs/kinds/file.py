"""Jobs that make files in one go."""

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from omomo_core.whole_file import partial_of


class FileJob:
    """One stage; its files appear whole or not at all."""

    def __init__(self, stage: str, write: Callable[[], None], files: Sequence[Path]) -> None:
        """Nothing is read yet.

        Args:
            stage: its name.
            write: does it all.
            files: what it writes.
        """
        self._stage, self._write, self._files = stage, write, files
        self._begin = time.perf_counter()

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """The one."""
        return {self._stage: self._write}

    @property
    def timings(self) -> Mapping[str, float]:
        """Of this attempt, which does everything again."""
        return {self._stage: round(time.perf_counter() - self._begin, 3)}

    def settle(self) -> None:
        """Files are flushed before they get their names."""

    def discard(self) -> None:
        """Remove what a killed attempt left."""
        for file in self._files:
            partial_of(file).unlink(missing_ok=True)
