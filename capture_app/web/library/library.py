"""Library: the folder as a whole."""

import re
import shutil
from pathlib import Path

from capture_app.web.library.folders import sweep_trash
from capture_app.web.library.results import Results
from capture_app.web.library.shelf import FILES, Shelf
from capture_app.web.library.uploads import Kind, Uploads

SHELVES: dict[Kind, str] = {
    "session": "sessions",
    "object": "objects",
    "mount": "mounts",
    "video": "videos",
    "contacts": "contacts",
}
"""Name of the folder of each kind of thing that is brought."""


class Library:
    """Where everything is that people bring and make."""

    def __init__(self, root: Path) -> None:
        """Open the library in a folder, which is made when it is not there."""
        self.root = root.resolve()
        self.scratch = self.root / "scratch"
        """For what lives as long as one piece of work."""
        self.shelves: dict[Kind, Shelf] = {
            kind: Shelf(self.root / name, kind) for kind, name in SHELVES.items()
        }
        self.results = Results(self.root / "results")
        self.uploads = Uploads(self.root / "uploads")
        for folder in (*self._folders, self.scratch):
            folder.mkdir(parents=True, exist_ok=True)
        self._prefix = _prefix(self.root)

    @property
    def database(self) -> str:
        """URL of the jobs' database."""
        return f"sqlite:///{self.root / 'jobs.sqlite'}"

    @property
    def free(self) -> int:
        """Bytes that the disk has left."""
        return shutil.disk_usage(self.root).free

    def shown(self, text: str) -> str:
        """A text for people: paths in the library become the names that people gave."""
        return self._prefix.sub("", text)

    def result_of(self, path: Path | None) -> str | None:
        """Id of the result that a path belongs to."""
        if path is None or not path.is_relative_to(self.results.folder):
            return None
        inside = path.relative_to(self.results.folder).parts
        return inside[0].partition(".")[0] if inside else None

    def holder(self, path: Path) -> str | None:
        """Id of the thing or the result that a path lies in."""
        for shelf in self.shelves.values():
            if path.is_relative_to(shelf.folder) and path != shelf.folder:
                return path.relative_to(shelf.folder).parts[0]
        return self.result_of(path)

    def sweep(self, orphan: float) -> None:
        """Take away uploads that nobody goes on with, and what a killed server left."""
        self.uploads.sweep(orphan)
        for folder in self._folders:
            sweep_trash(folder)

    def empty_scratch(self) -> None:
        """Take away what the work of an earlier server left; nothing may be at work."""
        for left in self.scratch.iterdir():
            shutil.rmtree(left, ignore_errors=True)

    @property
    def _folders(self) -> tuple[Path, ...]:
        shelves = (shelf.folder for shelf in self.shelves.values())
        return (*shelves, self.results.folder, self.uploads.folder)


def _prefix(root: Path) -> re.Pattern[str]:
    beside = rf"/{FILES}(?=/)|\.exports(?=/)|\.cache(?=/)|\.(?=contacts\.json)"
    place = rf"[a-z]+/[0-9a-f]{{16}}(?:{beside})?/?"
    return re.compile(rf"(?<![\w/]){re.escape(str(root))}(?:/{place}|/?)")
