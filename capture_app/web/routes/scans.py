"""What is known of an object that was scanned here: its report, its pictures, and the room it stood in."""

from fastapi import APIRouter
from fastapi.responses import FileResponse, HTMLResponse, Response

from capture_app.scanning.scan_folder import OUTLINE, VIEWS
from capture_app.web.cache import key
from capture_app.web.file_response import file_response, one_of
from capture_app.web.guards.headers import REPORT
from capture_app.web.library.ids import Id
from capture_app.web.routes.reports import SCENE, SCENE_REPLY
from capture_app.web.routes.results import FILE
from capture_app.web.sandbox import work
from capture_app.web.site import Here
from capture_app.web.sources import scan_of
from ingest.report.take_inspection import REPORT_PAGE

router = APIRouter(prefix="/api", tags=["objects"])


@router.get("/objects/{id}/scan/report.html", response_class=HTMLResponse)
def report(site: Here, id: Id) -> Response:
    """How good the scan is, and what to film again, as a page."""
    page = one_of(scan_of(site.library, id), REPORT_PAGE)
    text = site.library.shown(page.read_text(encoding="utf-8"))
    return HTMLResponse(text, headers={"content-security-policy": REPORT})


@router.get("/objects/{id}/scan/views.png", response_class=FileResponse, responses=FILE)
def views(site: Here, id: Id) -> FileResponse:
    """The mesh from four sides."""
    return file_response(one_of(scan_of(site.library, id), VIEWS), VIEWS)


@router.get("/objects/{id}/scan/outline.png", response_class=FileResponse, responses=FILE)
def outline(site: Here, id: Id) -> FileResponse:
    """Its outline, and the box that it was looked for in, on two of the film's pictures."""
    return file_response(one_of(scan_of(site.library, id), OUTLINE), OUTLINE)


@router.get("/rooms/{id}/scene", response_class=FileResponse, responses=SCENE_REPLY)
async def room_scene(site: Here, id: Id) -> FileResponse:
    """The room's mesh that was brought, or that lies in a session, as the viewer shows it."""
    shelf = site.library.shelf_of(id, "session", "material")
    scene = shelf.cache(id) / f"scene-{key('room')}.bin"
    if not scene.is_file():
        await site.sandbox.run(work.pack_room_scene, shelf.content(id), scene)
    return FileResponse(scene, media_type=SCENE)
