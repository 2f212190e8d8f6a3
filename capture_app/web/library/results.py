"""The results in the library: folders as `omocap run` writes them, and what we keep beside them."""

import shutil
from collections.abc import Callable
from pathlib import Path

from pydantic import ValidationError

from capture_app.library_item import Info, load_info, save_info
from capture_app.manifest import MANIFEST, Manifest
from capture_app.web.library.folders import remove_folder
from capture_app.web.library.shelf import missing


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
        found = [(place.name, self._info(place.name)) for place in places]
        return sorted(found, key=lambda item: (item[1].created, item[0]), reverse=True)

    def get(self, id_: str) -> Info:
        """What is known of one.

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
        """As announced; a folder that somebody copied in speaks for itself."""
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
