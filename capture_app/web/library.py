"""The library of the page on the disk: a shelf for each kind of thing, and the results that jobs make."""

import os
import re
import shutil
import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from pydantic import ValidationError

from capture_app.commands.inputs import ItemKind
from capture_app.library_item import FILES, Info, load_info, now, save_info
from capture_app.manifest import MANIFEST, Manifest
from capture_app.web.shelves import Shelf, missing, remove_folder, sweep_trash
from capture_app.web.unfinished_uploads import Uploads
from omomo_core.errors import InputError
from omomo_core.system import flush
from omomo_core.whole_file import write_whole


class Results:
    """All results; a result is there as soon as its folder is whole."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def place(self, id_: str) -> Path:
        """The folder of a result, whether it is there yet or not."""
        return self.folder / id_

    def announce(self, id_: str, info: Info) -> None:
        """Say what a result that is still to be made will be called, and what it is made from."""
        save_info(self._beside(id_, ".json"), info)

    def contacts(self, id_: str) -> Path:
        """File for the contacts that a result is to be made with."""
        return self._beside(id_, ".contacts.json")

    def list(self) -> "list[tuple[str, Info]]":
        """All by id, the newest first."""
        places = [p.parent for p in self.folder.glob(f"[0-9a-f]*/{MANIFEST}")]
        results = [(place.name, self._info(place.name)) for place in places]
        return sorted(results, key=lambda item: (item[1].created, item[0]), reverse=True)

    def get(self, id_: str) -> Info:
        """Return what is known of a result.

        Raises:
            Refused: 404 when it is not there.
        """
        if not (self.place(id_) / MANIFEST).is_file():
            raise missing("result", id_)
        return self._info(id_)

    def content(self, id_: str) -> Path:
        """Its folder.

        Raises:
            Refused: 404 when it is not there.
        """
        self.get(id_)
        return self.place(id_)

    def change(self, id_: str, edit: Callable[[Info], Info]) -> Info:
        """Write an edited record.

        Raises:
            Refused: 404 when it is not there.
        """
        info = edit(self.get(id_))
        self.announce(id_, info)
        return info

    def exports(self, id_: str) -> Path:
        """Folder of files made of it; it may not be there yet."""
        return self._beside(id_, ".exports")

    def make_exports(self, id_: str) -> Path:
        """The same, once it is there."""
        place = self.exports(id_)
        place.mkdir(exist_ok=True)
        return place

    def cache(self, id_: str) -> Path:
        """Folder for what can be made again from it."""
        place = self._beside(id_, ".cache")
        place.mkdir(exist_ok=True)
        return place

    def remove(self, id_: str) -> None:
        """Take it away with all that was made of it.

        Raises:
            Refused: 404 when it is not there.
        """
        self.get(id_)
        remove_folder(self.place(id_))
        for ending in (".exports", ".cache"):
            shutil.rmtree(self._beside(id_, ending), ignore_errors=True)
        for ending in (".json", ".contacts.json"):
            self._beside(id_, ending).unlink(missing_ok=True)

    def _beside(self, id_: str, ending: str) -> Path:
        return self.folder / f"{id_}{ending}"

    def _info(self, id_: str) -> Info:
        """Return what was announced of it; a folder that somebody copied in speaks for itself."""
        info = load_info(self._beside(id_, ".json")) or _from_manifest(self.place(id_))
        files = [file for file in self.place(id_).iterdir() if file.is_file()]
        size = sum(file.stat().st_size for file in files)
        return info.model_copy(update={"size": size, "files": len(files)})


def _from_manifest(folder: Path) -> Info:
    try:
        made = Manifest.model_validate_json((folder / MANIFEST).read_bytes()).created
    except (OSError, ValidationError):
        return Info(name=folder.name)
    return Info(name=folder.name, created=made)


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
    """The folder of everything that people bring and make."""

    def __init__(self, root: Path) -> None:
        """Open the library in a folder, which is made when it is not there."""
        self.root = root.resolve()
        self.scratch = self.root / "scratch"
        """Folder for what lives as long as one piece of work."""
        self.cache = self.root / "cache"
        """Folder for what can be made again from nothing that was brought."""
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
        """Return the page's address of the thing or the result at this path, such as "mounts/ID"."""
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
        for remnant in self.scratch.iterdir():
            shutil.rmtree(remnant, ignore_errors=True)

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


@contextmanager
def only_server(root: Path) -> Generator[Path]:
    """Hold the library while the block runs; gives the file to write the server's address into.

    Raises:
        InputError: "library-served": another server holds it.
    """
    path = root / "server"
    with path.open("a+", encoding="utf-8") as file:
        if not _hold(file.fileno()):
            address = path.read_text(encoding="utf-8").strip()
            raise InputError(
                "library-served",
                "Another server has this library open.",
                where=str(root),
                fix=f"Open {address} in a browser, or give another folder with ‹library›."
                if address
                else "Stop it, or give another folder with ‹library›.",
            )
        file.truncate(0)
        yield path


def _hold(handle: int) -> bool:
    """Lock an open file until it is closed; the system frees it when the process dies."""
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
