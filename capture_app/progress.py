"""Progress callbacks of a run, which get the name of a stage and the fraction done."""

import time
from collections.abc import Callable, Mapping

Progress = Callable[[str, float], None]
"""Called with the name of a stage and the fraction of it that is done, 0 to 1."""


def silent(stage: str, fraction: float) -> None:
    """Ignore progress."""


class StageClock:
    """A progress callback that adds up the seconds of each stage, and passes progress on.

    Stages run one after the other, so the time since the last call went into the stage that is
    heard of now.
    """

    def __init__(self, listener: Progress, seconds: Mapping[str, float] | None = None) -> None:
        """`seconds` were spent before, where another process began."""
        self._listener = listener
        self._seconds = dict(seconds or {})
        self._last = time.perf_counter()

    def __call__(self, stage: str, fraction: float) -> None:
        """Note the time and pass the call on."""
        now = time.perf_counter()
        self._seconds[stage] = self._seconds.get(stage, 0.0) + now - self._last
        self._last = now
        self._listener(stage, fraction)

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds spent in each stage, to the millisecond."""
        return {stage: round(seconds, 3) for stage, seconds in self._seconds.items()}
