"""Folders that go away at once, and ways to make sure that what is written stays."""

import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from capture_app.web.library.ids import new_id
from omomo_core.system import flush

TRASH = ".trash-"
_AT_ONCE = 16


def remove_folder(folder: Path) -> None:
    """Take a folder away under its name in one step; its bytes follow."""
    aside = folder.with_name(f"{TRASH}{new_id()}")
    os.rename(folder, aside)
    shutil.rmtree(aside, ignore_errors=True)


def sweep_trash(folder: Path) -> None:
    """Finish what a killed server had begun to remove."""
    for left in folder.glob(f"{TRASH}*"):
        shutil.rmtree(left, ignore_errors=True)


def keep_tree(folder: Path) -> None:
    """Flush a folder and all that is in it."""
    places = [Path(place) for place, _, _ in os.walk(folder)]
    files = [Path(place, name) for place, _, names in os.walk(folder) for name in names]
    # A disk flushes many files at once about as fast as one.
    with ThreadPoolExecutor(_AT_ONCE) as pool:
        for batch in (files, places):
            list(pool.map(flush, batch))
