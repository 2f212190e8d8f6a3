"""A shelf of the library: things that were brought, each a folder with its files and an info.json.

A name of a thing is safe to build a path from. A folder goes away at once, and what is written stays.
"""

import os
import secrets
import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import StringConstraints

from capture_app.library_item import FILES, INFO, Info, load_info, save_info
from capture_app.web.problems import Refused
from omomo_core.system import flush

PATTERN = r"^[0-9a-f]{16}$"

Id = Annotated[str, StringConstraints(pattern=PATTERN)]
"""Sixteen hex digits that the server made; the only thing a client says that enters a path."""


def new_id() -> str:
    """One that nobody can guess, nor meet again."""
    return secrets.token_hex(8)


TRASH = ".trash-"
_AT_ONCE = 16


def remove_folder(folder: Path) -> None:
    """Take a folder away under its name in one step; its bytes follow."""
    aside = folder.with_name(f"{TRASH}{new_id()}")
    os.rename(folder, aside)
    shutil.rmtree(aside, ignore_errors=True)


def sweep_trash(folder: Path) -> None:
    """Finish what a killed server had begun to remove."""
    for remnant in folder.glob(f"{TRASH}*"):
        shutil.rmtree(remnant, ignore_errors=True)


def keep_tree(folder: Path) -> None:
    """Flush a folder and all that is in it."""
    places = [Path(place) for place, _, _ in os.walk(folder)]
    files = [Path(place, name) for place, _, names in os.walk(folder) for name in names]
    # A disk flushes many files at once about as fast as one.
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        for batch in (files, places):
            list(pool.map(flush, batch))


CACHE = "cache"


@dataclass(frozen=True)
class Shelf:
    """Sessions, objects, mounts, videos or contacts."""

    folder: Path
    word: str
    """One thing on it, e.g. "session"."""

    def list(self) -> "list[tuple[str, Info]]":
        """All things by id, the newest first."""
        things = [(place.name, load_info(place / INFO)) for place in self.folder.glob("[0-9a-f]*")]
        known = [(id_, info) for id_, info in things if info is not None]
        return sorted(known, key=lambda item: (item[1].created, item[0]), reverse=True)

    def get(self, id_: str) -> Info:
        """Return what is known of a thing.

        Raises:
            Refused: 404 when it is not there.
        """
        info = load_info(self.folder / id_ / INFO)
        if info is None:
            raise missing(self.word, id_)
        return info

    def content(self, id_: str) -> Path:
        """Return what readers are given: the one file or folder that was brought, or the folder of many.

        Raises:
            Refused: 404 when it is not there.
        """
        self.get(id_)
        return content_of(self.folder / id_ / FILES)

    def change(self, id_: str, edit: Callable[[Info], Info]) -> Info:
        """Write an edited record.

        Raises:
            Refused: 404 when it is not there.
        """
        info = edit(self.get(id_))
        save_info(self.folder / id_ / INFO, info)
        return info

    def remove(self, id_: str) -> None:
        """Take it away.

        Raises:
            Refused: 404 when it is not there.
        """
        self.get(id_)
        remove_folder(self.folder / id_)

    def cache(self, id_: str) -> Path:
        """Folder for what can be made again from it."""
        place = self.folder / id_ / CACHE
        place.mkdir(exist_ok=True)
        return place

    def put(self, id_: str, info: Info, source: Path) -> None:
        """Take in a folder with `files` in it under an id of its own, in one step."""
        save_info(source / INFO, info)
        os.rename(source, self.folder / id_)
        flush(self.folder)


def content_of(files: Path) -> Path:
    """The one file or folder in a folder, or the folder of many."""
    entries = list(files.iterdir())
    return entries[0] if len(entries) == 1 else files


def missing(word: str, id_: str) -> Refused:
    """The 404 of a thing that is not there."""
    return Refused(
        404,
        f"{word}-missing",
        f"There is no such {word}.",
        where=id_,
        fix="It may have been deleted: load the list again.",
    )
