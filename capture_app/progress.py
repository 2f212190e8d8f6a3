"""Progress callbacks of a run, which get the name of a stage and the fraction done."""

import threading
import time
from collections.abc import Callable, Mapping

Progress = Callable[[str, float], None]
"""Called with the name of a stage and the fraction of it that is done, 0 to 1."""


def silent(stage: str, fraction: float) -> None:
    """Ignore progress."""


class StageClock:
    """A progress callback that adds up the seconds of each stage, and passes progress on.

    The time since the last call goes to the stage that is heard of now. Several threads may call; the
    listener hears them one after the other.
    """

    def __init__(self, listener: Progress, seconds: Mapping[str, float] | None = None) -> None:
        """`seconds` were spent before, where another process began."""
        self._listener = listener
        self._seconds = dict(seconds or {})
        self._last = time.perf_counter()
        self._lock = threading.Lock()

    def __call__(self, stage: str, fraction: float) -> None:
        """Note the time and pass the call on."""
        with self._lock:
            now = time.perf_counter()
            self._seconds[stage] = self._seconds.get(stage, 0.0) + now - self._last
            self._last = now
            self._listener(stage, fraction)

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds spent in each stage, to the millisecond."""
        return {stage: round(seconds, 3) for stage, seconds in self._seconds.items()}
