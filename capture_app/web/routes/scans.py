"""What is known of an object that was scanned here: its report and its pictures."""

from fastapi import APIRouter
from fastapi.responses import FileResponse, HTMLResponse, Response

from capture_app.scanning.folder import OUTLINE, VIEWS
from capture_app.web.file_response import file_response, one_of
from capture_app.web.guards.headers import REPORT
from capture_app.web.library.ids import Id
from capture_app.web.routes.results import FILE
from capture_app.web.site import Here
from capture_app.web.sources import scan_of
from ingest.report.scanned import REPORT_PAGE

router = APIRouter(prefix="/api/objects", tags=["objects"])


@router.get("/{id}/scan/report.html", response_class=HTMLResponse)
def report(site: Here, id: Id) -> Response:
    """How good the scan is, and what to film again, as a page."""
    page = one_of(scan_of(site.library, id), REPORT_PAGE)
    text = site.library.shown(page.read_text(encoding="utf-8"))
    return HTMLResponse(text, headers={"content-security-policy": REPORT})


@router.get("/{id}/scan/views.png", response_class=FileResponse, responses=FILE)
def views(site: Here, id: Id) -> FileResponse:
    """The mesh from four sides."""
    return file_response(one_of(scan_of(site.library, id), VIEWS), VIEWS)


@router.get("/{id}/scan/outline.png", response_class=FileResponse, responses=FILE)
def outline(site: Here, id: Id) -> FileResponse:
    """Its outline, and the box that it was looked for in, on two of the film's pictures."""
    return file_response(one_of(scan_of(site.library, id), OUTLINE), OUTLINE)
