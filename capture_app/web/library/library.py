"""Library: the folder as a whole."""

import os
import re
import shutil
from pathlib import Path

from capture_app.commands.inputs import ItemKind
from capture_app.library_item import FILES, now
from capture_app.web.library.folders import sweep_trash
from capture_app.web.library.results import Results
from capture_app.web.library.shelf import Shelf, missing
from capture_app.web.library.uploads import Uploads
from omomo_core.system import flush
from omomo_core.whole_file import write_whole


class Notes:
    """The folder of the notes of all orders."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def write(self, id_: str, name: str, text: str) -> Path:
        """Write one, which stays as long as the job is remembered.

        Args:
            id_: of the job.
            name: of the file, one of ours.
            text: what it says.
        """
        place = self.folder / id_
        place.mkdir(exist_ok=True)
        write_whole(place / name, text)
        flush(place, self.folder)
        return place / name

    def forget(self, id_: str) -> None:
        """Take away those of a job."""
        shutil.rmtree(self.folder / id_, ignore_errors=True)


SHELVES: dict[ItemKind, str] = {
    "session": "sessions",
    "object": "objects",
    "mount": "mounts",
    "video": "videos",
    "contacts": "contacts",
    "material": "materials",
}
"""Name of the folder of each kind of thing that is brought."""


_DATABASE = "jobs.sqlite"


class Library:
    """Where everything is that people bring and make."""

    def __init__(self, root: Path) -> None:
        """Open the library in a folder, which is made when it is not there."""
        self.root = root.resolve()
        self.scratch = self.root / "scratch"
        """For what lives as long as one piece of work."""
        self.cache = self.root / "cache"
        """For what can be made again from nothing that was brought."""
        self.notes = Notes(self.root / "orders")
        self.shelves: dict[ItemKind, Shelf] = {
            kind: Shelf(self.root / name, kind) for kind, name in SHELVES.items()
        }
        self.results = Results(self.root / "results")
        self.uploads = Uploads(self.root / "uploads")
        for folder in (*self._folders, self.scratch, self.cache):
            folder.mkdir(parents=True, exist_ok=True)
        self._prefix = _prefix(self.root)

    @property
    def database(self) -> str:
        """URL of the jobs' database."""
        return f"sqlite:///{self.root / _DATABASE}"

    def give_up_jobs(self) -> Path:
        """Put the jobs' database aside, with all that only its jobs would have gone on with.

        Returns:
            Where it is now.
        """
        file = self.root / _DATABASE
        aside = self.root / f"jobs-damaged-{now():%Y-%m-%d-%H%M%S}.sqlite"
        for ending in ("", "-wal", "-shm"):
            beside = file.with_name(f"{file.name}{ending}")
            if beside.exists():
                os.replace(beside, aside.with_name(f"{aside.name}{ending}"))
        for folder in self._folders:
            for part in folder.glob(".*.part"):
                shutil.rmtree(part, ignore_errors=True)
        flush(self.root)
        return aside

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

    def content(self, id_: str, *kinds: ItemKind) -> Path:
        """What readers are given of a thing of any of these kinds.

        Raises:
            Refused: 404 when there is none.
        """
        return self.shelf_of(id_, *kinds).content(id_)

    def shelf_of(self, id_: str, *kinds: ItemKind) -> Shelf:
        """The shelf of a thing of any of these kinds.

        Raises:
            Refused: 404 when there is none.
        """
        for kind in kinds:
            if (self.shelves[kind].folder / id_).is_dir():
                return self.shelves[kind]
        raise missing(kinds[0], id_)

    def item_of(self, path: Path) -> str | None:
        """Where the page shows the thing or the result at this path, such as "mounts/ID"."""
        for folder in self._shown:
            if path.parent == folder:
                return f"{folder.name}/{path.name}"
        return None

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
    def _shown(self) -> tuple[Path, ...]:
        """Folders of what has a page of its own."""
        shown: tuple[ItemKind, ...] = ("session", "object", "mount")
        return (*(self.shelves[kind].folder for kind in shown), self.results.folder)

    @property
    def _folders(self) -> tuple[Path, ...]:
        shelves = (shelf.folder for shelf in self.shelves.values())
        return (*shelves, self.results.folder, self.notes.folder, self.uploads.folder)


def _prefix(root: Path) -> re.Pattern[str]:
    beside = rf"/{FILES}(?=/)|\.exports(?=/)|\.cache(?=/)|\.(?=contacts\.json)"
    place = rf"[a-z]+/[0-9a-f]{{16}}(?:{beside})?/?"
    return re.compile(rf"(?<![\w/]){re.escape(str(root))}(?:/{place}|/?)")
