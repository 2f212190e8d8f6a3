"""Files as answers: those that people brought or made, and those of the page and the viewer.

A file of a person is served as nothing that a browser would run. A file of the program is served under its
name and no other.
"""

import hashlib
import json
import mimetypes
import re
from importlib.metadata import version
from pathlib import Path
from typing import Any
from unicodedata import normalize
from urllib.parse import quote

from fastapi import FastAPI
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from capture_app.commands.inputs import DescribedModel
from capture_app.replay import VIEWER
from capture_app.web.guards import SANDBOX
from capture_app.web.problems import Refused

_SHOWN = {
    ".mp4": "video/mp4",
    ".webp": "image/webp",
    ".png": "image/png",
    ".gif": "image/gif",
}
"""The only kinds that a browser may show by itself."""


def binary(description: str, *kinds: str) -> dict[int | str, dict[str, Any]]:
    """Return how a route that answers with a file describes its reply.

    Args:
        description: what the file is.
        kinds: content types that it may have.
    """
    schema = {"schema": {"type": "string", "format": "binary"}}
    return {200: {"description": description, "content": dict.fromkeys(kinds, schema)}}


DOWNLOAD = "application/octet-stream"
FILE = binary(
    "The file; what no browser shows by itself is a download.", DOWNLOAD, *_SHOWN.values()
)
PICTURE = binary("A picture.", "image/png")


class ResultFile(DescribedModel):
    """A file as the page lists it."""

    name: str
    """Its file name."""
    size: int
    """Bytes."""
    href: str
    """Address on this server from which it is loaded."""


def file_response(path: Path, name: str) -> FileResponse:
    """The bytes of a file, or the part that is asked for; all but films and pictures as a download.

    Args:
        path: the file.
        name: what a download is called.
    """
    kind = _SHOWN.get(path.suffix.lower())
    return FileResponse(
        path,
        media_type=kind or DOWNLOAD,
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


def cache_key(*inputs: Any) -> str:
    """Return the name of what is made from these inputs by this version of the program."""
    text = json.dumps([version("omocap"), *map(str, inputs)])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


PAGE = Path(__file__).parent / "page"
_INDEX = "index.html"
_PLAIN = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]*(/[A-Za-z0-9_-][A-Za-z0-9_.-]*)*")
_KINDS = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
"""What some systems do not know, or call something else."""


class OwnFiles(StaticFiles):
    """Files of a folder of the program; asked for again each time, so that an update is seen."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """A file; nothing but a plain name is looked for."""
        if not _PLAIN.fullmatch(path):
            raise HTTPException(404)
        answer = await super().get_response(path, scope)
        answer.headers["cache-control"] = "no-cache"
        return answer


def add_pages(app: FastAPI, page: Path = PAGE) -> None:
    """Serve the page at / and /static, and the viewer at /static/viewer."""
    for ending, kind in _KINDS.items():
        mimetypes.add_type(kind, ending)

    @app.get("/", include_in_schema=False)
    def index() -> FileResponse:
        return FileResponse(page / _INDEX, headers={"cache-control": "no-cache"})

    assert index
    app.mount("/static/viewer", OwnFiles(directory=VIEWER))
    app.mount("/static", OwnFiles(directory=page))
