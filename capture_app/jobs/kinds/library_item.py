"""Jobs that make a thing of the library: it appears whole, with what is known of it."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from capture_app.commands.request import ItemRequest
from capture_app.jobs.protocol import Attempt
from capture_app.library_item import FILES, INFO, info_of, save_info
from capture_app.progress import Progress, StageClock
from capture_app.staging import Staging

Make = Callable[[Path, Progress], dict[str, Any]]
"""Given the folder of the thing, whose `files` are there, fills it; returns facts about it."""


class ItemJob:
    """A thing in the making; what an earlier attempt left in its folder may be gone on with."""

    def __init__(self, order: ItemRequest, attempt: Attempt, make: Make) -> None:
        """Nothing is read yet."""
        self._order, self._attempt, self._fill = order, attempt, make
        self._staging = Staging(order.output, key=attempt.id)
        self._clock = StageClock(attempt.progress, attempt.timings)

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """Make it, put it in its place."""
        return {"make": self._make, "finish": self._staging.publish}

    @property
    def timings(self) -> Mapping[str, float]:
        """By stage of the progress."""
        return self._clock.seconds

    def settle(self) -> None:
        """Flush the folder; it is flushed already when it has its name."""
        if self._staging.folder.exists():
            self._staging.flush()

    def discard(self) -> None:
        """Remove the folder."""
        self._staging.discard()

    def _make(self) -> None:
        folder = self._staging.open()
        (folder / FILES).mkdir(exist_ok=True)
        facts = {**self._order.facts, **self._fill(folder, self._clock)}
        save_info(folder / INFO, info_of(self._order.name, folder / FILES, facts))
        self._attempt.tell(facts)
