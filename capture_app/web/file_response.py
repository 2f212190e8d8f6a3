"""served: a file that people brought or made, as nothing that a browser would run."""

import re
from pathlib import Path
from unicodedata import normalize
from urllib.parse import quote

from pydantic import BaseModel
from starlette.responses import FileResponse

from capture_app.web.guards.headers import SANDBOX
from capture_app.web.problems import Refused

_SHOWN = {
    ".mp4": "video/mp4",
    ".webp": "image/webp",
    ".png": "image/png",
    ".gif": "image/gif",
}
"""The only kinds that a browser may show by itself."""


class ResultFile(BaseModel):
    """A file as the page lists it."""

    name: str
    size: int
    href: str


def file_response(path: Path, name: str) -> FileResponse:
    """The bytes of a file, or the part that is asked for; all but films and pictures as a download.

    Args:
        path: the file.
        name: what a download is called.
    """
    kind = _SHOWN.get(path.suffix.lower())
    return FileResponse(
        path,
        media_type=kind or "application/octet-stream",
        filename=name,
        content_disposition_type="inline" if kind else "attachment",
        headers={"content-security-policy": SANDBOX, "cache-control": "private, no-cache"},
        stat_result=path.stat(),
    )


def listed(folder: Path, at: str) -> list[ResultFile]:
    """The files of a folder, as the page lists them.

    Args:
        folder: where they are; there may be none.
        at: address that their names come behind.
    """
    return [
        ResultFile(name=file.name, size=file.stat().st_size, href=f"{at}/{quote(file.name)}")
        for file in sorted(_files(folder))
    ]


def one_of(folder: Path, name: str) -> Path:
    """The file of that name, looked for among those that are there and never made into a path.

    Raises:
        Refused: 404.
    """
    for file in _files(folder):
        if file.name == name:
            return file
    raise Refused(
        404,
        "file-missing",
        "There is no such file.",
        where=f"{name!r:.90}",
        fix="Load the list of files again.",
    )


def file_name(name: str) -> str:
    """A person's name for a thing as part of a file name, in plain letters."""
    plain = normalize("NFKD", name).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9]+", "-", plain).strip("-").lower()[:60] or "motion"


def _files(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    return [p for p in folder.iterdir() if p.is_file() and not p.name.startswith(".")]
