"""The page and the viewer: files of ours, each under its name and no other."""

import mimetypes
import re
from pathlib import Path

from fastapi import FastAPI
from fastapi.responses import FileResponse, Response
from starlette.exceptions import HTTPException
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from capture_app.replay import VIEWER

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
