"""What is known of a session before time is spent on it: its report, and its scene to be replayed."""

import json
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse, HTMLResponse, Response
from pydantic import BaseModel, ConfigDict

from capture_app.web.cache import key
from capture_app.web.guards.headers import REPORT
from capture_app.web.library.ids import Id
from capture_app.web.page_words import all_in_page_words
from capture_app.web.problems import ErrorDetail, Refused, is_of_the_disk
from capture_app.web.sandbox import work
from capture_app.web.sandbox.report import unreadable
from capture_app.web.site import Here, Site
from capture_app.web.sources import ReadAs, mesh_file_of, seen_with
from ingest.trajectory.trajectory_config import AS_LOGGED
from omomo_core.errors import InputError

router = APIRouter(prefix="/api", tags=["reports"])

SCENE = "application/octet-stream"
SCENE_REPLY: dict[int | str, dict[str, Any]] = {200: {"content": {SCENE: {}}}}
Asked = Annotated[ReadAs, Query()]
_PAGE_REPLY: dict[int | str, dict[str, Any]] = {200: {"content": {"text/html": {}}}}


class ReportCheck(BaseModel):
    """One verdict on a take."""

    name: str
    severity: str
    message: str
    fix: str
    frames: tuple[int, int] | None
    seconds: tuple[float | None, float | None] | None


class ReportHeadline(BaseModel):
    """Its headline; null where the session cannot be read."""

    seconds: float | None
    rate: float | None
    stretches: int | None
    longest: float | None


class Report(BaseModel):
    """What `omocap inspect` finds."""

    model_config = ConfigDict(extra="forbid")

    verdict: str
    """Of a run with the same object, mount and options: "good", "usable with limits" or "not usable";
    "not judged" of an object's own motion."""
    reason: str
    """Why it is not better, in one line."""
    advice: str
    app: str
    animated: bool
    """A run would take it for the object's own motion, which needs no mount."""
    seconds: float
    poses: int
    rate: float | None
    checks: list[ReportCheck]
    segments: list[tuple[float, float]]
    floor: str
    problem: ErrorDetail | None
    facts: ReportHeadline


@router.get("/sessions/{id}/report")
async def report(site: Here, id: Id, said: Asked) -> Report:
    """The report on a session, with what to fix; one that cannot be read says why."""
    seen = seen_with(site.library, id, said)
    try:
        data, _ = await _inspected(site, id, seen)
    except InputError as problem:
        if is_of_the_disk(problem):
            raise
        if seen.reading == AS_LOGGED:
            _note(site, id, {"verdict": "not usable"})
        return _shown(site, unreadable(problem))
    return _shown(site, json.loads(data.read_bytes()))


@router.get("/sessions/{id}/report.html", response_class=HTMLResponse, responses=_PAGE_REPLY)
async def report_page(site: Here, id: Id, said: Asked) -> Response:
    """The report as a page with plots."""
    _, page = await _inspected(site, id, seen_with(site.library, id, said))
    if not page.is_file():
        raise Refused(
            404,
            "report-none",
            "This is the motion of an object; there are no checks of it.",
            where=id,
            fix="Make the motion.",
        )
    text = site.library.shown(page.read_text(encoding="utf-8"))
    return HTMLResponse(text, headers={"content-security-policy": REPORT})


@router.get("/sessions/{id}/scene", response_class=FileResponse, responses=SCENE_REPLY)
async def session_scene(site: Here, id: Id, said: Asked) -> FileResponse:
    """The session as the viewer plays it."""
    seen = seen_with(site.library, id, said)
    made = key("scene", seen)
    scene = site.library.shelves["session"].cache(id) / f"scene-{made}.bin"
    if not scene.is_file():
        await site.sandbox.run(work.pack_session_scene, seen, scene)
    return FileResponse(scene, media_type=SCENE)


@router.get("/objects/{id}/scene", response_class=FileResponse, responses=SCENE_REPLY)
async def object_scene(site: Here, id: Id) -> FileResponse:
    """The object as the viewer shows it."""
    mesh_file = mesh_file_of(site.library, id)
    scene = site.library.shelves["object"].cache(id) / f"scene-{key('scene', mesh_file)}.bin"
    if not scene.is_file():
        await site.sandbox.run(work.pack_object_scene, mesh_file.path, mesh_file.scale, scene)
    return FileResponse(scene, media_type=SCENE)


async def _inspected(site: Site, id_: str, seen: work.SessionInputs) -> tuple[Path, Path]:
    """The files of a report, which are written when it is asked for the first time."""
    made = key("report", seen)
    folder = site.library.shelves["session"].cache(id_)
    data, page = folder / f"report-{made}.json", folder / f"report-{made}.html"
    if not data.is_file():
        found = await site.sandbox.run(work.inspect, seen, data, page)
        if seen.reading != AS_LOGGED:
            # What somebody tries out says nothing about the recording.
            found.pop("verdict")
        _note(site, id_, found)
    return data, page


def _note(site: Site, id_: str, found: dict[str, Any]) -> None:
    """Keep what lists tell of a session."""
    shelf = site.library.shelves["session"]
    shelf.change(id_, lambda info: info.model_copy(update={"facts": {**info.facts, **found}}))


def _shown(site: Site, found: dict[str, Any]) -> Report:
    """With the names that people gave in place of paths."""
    found = all_in_page_words(found, "run")
    if found["problem"] is not None:
        found["problem"] = {k: site.library.shown(v) for k, v in found["problem"].items()}
    return Report.model_validate(
        {**found, **{k: site.library.shown(found[k]) for k in ("reason", "advice")}}
    )
