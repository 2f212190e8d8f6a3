"""Notes: what an order says that its job reads as a file, by the id of the job."""

import shutil
from pathlib import Path

from capture_app.web.library.folders import keep
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
        keep(place, self.folder)
        return place / name

    def forget(self, id_: str) -> None:
        """Take away those of a job."""
        shutil.rmtree(self.folder / id_, ignore_errors=True)
