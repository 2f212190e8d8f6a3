"""Reports, scenes and pictures of what is in the library.

A session has a report before time is spent on it, an object that was scanned here has that of its scan.
Posters are drawn by the job that makes a thing, or when they are first asked for.
"""

import asyncio
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import parse_qsl

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse, HTMLResponse, Response
from pydantic import ConfigDict, StringConstraints, ValidationError

from capture_app.commands.inputs import DescribedModel, MeshFile
from capture_app.library_item import PICTURE as POSTER
from capture_app.scanning.scan_folder import OUTLINE, VIEWS
from capture_app.web import sandboxed_work
from capture_app.web.file_response import (
    DOWNLOAD,
    PICTURE,
    binary,
    cache_key,
    file_response,
    one_of,
)
from capture_app.web.guards import REPORT
from capture_app.web.page_words import all_in_page_words
from capture_app.web.problems import ErrorDetail, Refused, is_of_the_disk
from capture_app.web.sandbox_process import Work
from capture_app.web.sandboxed_work import unreadable
from capture_app.web.site import Here, Site, ThingId
from capture_app.web.sources import ReadAs, mesh_file_of, scan_of, seen_with
from ingest.report.take_inspection import REPORT_PAGE
from ingest.trajectory.trajectory_config import AS_LOGGED
from omomo_core.errors import InputError

router = APIRouter(prefix="/api", tags=["reports"])

SCENE = DOWNLOAD
SCENE_REPLY = binary(
    "A packed scene: the length of its JSON as 4 bytes, little-endian; the JSON, which lists arrays; "
    "the arrays.",
    SCENE,
)
Asked = Annotated[ReadAs, Query()]
_PAGE_REPLY: dict[int | str, dict[str, Any]] = {200: {"content": {"text/html": {}}}}


class ReportCheck(DescribedModel):
    """One verdict on a take."""

    name: str
    """What was checked."""
    severity: str
    """"ok", "warn" or "bad"."""
    message: str
    """What was found, in a sentence."""
    fix: str
    """What to do about it; "" where there is nothing."""
    frames: tuple[int, int] | None
    """First and last pose of the log that it is about; null for all of it."""
    seconds: tuple[float | None, float | None] | None
    """Their times, seconds from the start of the log."""


class ReportHeadline(DescribedModel):
    """Its headline; null where the session cannot be read."""

    seconds: float | None
    """How long the log is, seconds."""
    rate: float | None
    """Poses a second."""
    stretches: int | None
    """How many tracking failures left."""
    longest: float | None
    """How long the longest of them is, seconds."""


class Report(DescribedModel):
    """What `omocap inspect` finds."""

    model_config = ConfigDict(extra="forbid")

    verdict: str
    """Verdict on a run with the same object, mount and options: "good", "usable with limits", "not usable";
    "not judged" of an object's own motion."""
    reason: str
    """Why it is not better, in one line."""
    advice: str
    """What to do next, in a sentence."""
    app: str
    """The app that recorded it."""
    animated: bool
    """A run would take it for the object's own motion, which needs no mount."""
    seconds: float
    """How long the log is, seconds."""
    poses: int
    """How many the log has."""
    rate: float | None
    """Poses a second; null where there are too few to tell."""
    checks: list[ReportCheck]
    """All that was checked."""
    segments: list[tuple[float, float]]
    """Start and end of each stretch that tracking failures left, seconds from the start of the log."""
    floor: str
    """The height of the floor and how it was found, in a sentence."""
    problem: ErrorDetail | None
    """Why the log cannot be read; null where it can."""
    facts: ReportHeadline
    """What a list of sessions tells of it."""


@router.get("/sessions/{id}/report")
async def report(site: Here, id: ThingId, said: Asked) -> Report:
    """The report on a session, with what to fix; one that cannot be read says why."""
    seen = seen_with(site.library, id, said)
    try:
        data = await inspected(site, id, seen)
    except InputError as problem:
        if is_of_the_disk(problem):
            raise
        if seen.reading == AS_LOGGED:
            _note(site, id, {"verdict": "not usable"})
        return _shown(site, unreadable(problem))
    return _shown(site, json.loads(data.read_bytes()))


@router.get("/sessions/{id}/report.html", response_class=HTMLResponse, responses=_PAGE_REPLY)
async def report_page(site: Here, id: ThingId, said: Asked) -> Response:
    """The report as a page with plots and, where the object is known, the phone on it."""
    seen = seen_with(site.library, id, said)
    page = site.library.shelves["session"].cache(id) / f"report-{cache_key('report', seen)}.html"
    if not page.is_file():
        await site.sandbox.run(sandboxed_work.write_page, seen, page)
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
async def session_scene(site: Here, id: ThingId, said: Asked) -> FileResponse:
    """The session as the viewer plays it."""
    seen = seen_with(site.library, id, said)
    made = cache_key("scene", seen)
    scene = site.library.shelves["session"].cache(id) / f"scene-{made}.bin"
    if not scene.is_file():
        await site.sandbox.run(sandboxed_work.pack_session_scene, seen, scene)
    return FileResponse(scene, media_type=SCENE)


@router.get("/objects/{id}/scene", response_class=FileResponse, responses=SCENE_REPLY)
async def object_scene(site: Here, id: ThingId) -> FileResponse:
    """The object as the viewer shows it."""
    mesh_file = mesh_file_of(site.library, id)
    scene = site.library.shelves["object"].cache(id) / f"scene-{cache_key('scene', mesh_file)}.bin"
    if not scene.is_file():
        await site.sandbox.run(
            sandboxed_work.pack_object_scene, mesh_file.path, mesh_file.scale, scene
        )
    return FileResponse(scene, media_type=SCENE)


async def inspected(site: Site, id_: str, inputs: sandboxed_work.SessionInputs) -> Path:
    """The file of a report, which is written when it is asked for the first time."""
    made = cache_key("report", inputs)
    data = site.library.shelves["session"].cache(id_) / f"report-{made}.json"
    if not data.is_file():
        headline = await site.sandbox.run(sandboxed_work.inspect, inputs, data)
        if inputs.reading != AS_LOGGED:
            # What somebody tries out says nothing about the recording.
            headline.pop("verdict")
        _note(site, id_, headline)
    return data


def _note(site: Site, id_: str, headline: dict[str, Any]) -> None:
    """Keep what lists tell of a session."""
    shelf = site.library.shelves["session"]
    shelf.change(id_, lambda info: info.model_copy(update={"facts": {**info.facts, **headline}}))


def _shown(site: Site, data: dict[str, Any]) -> Report:
    """Return a report with the names that people gave in place of paths."""
    data = all_in_page_words(data, "run")
    if data["problem"] is not None:
        data["problem"] = {k: site.library.shown(v) for k, v in data["problem"].items()}
    return Report.model_validate(
        {**data, **{k: site.library.shown(data[k]) for k in ("reason", "advice")}}
    )


scan_router = APIRouter(prefix="/api", tags=["objects"])


@scan_router.get("/objects/{id}/scan/report.html", response_class=HTMLResponse)
def scan_report(site: Here, id: ThingId) -> Response:
    """How good the scan is, and what to film again, as a page."""
    page = one_of(scan_of(site.library, id), REPORT_PAGE)
    text = site.library.shown(page.read_text(encoding="utf-8"))
    return HTMLResponse(text, headers={"content-security-policy": REPORT})


@scan_router.get("/objects/{id}/scan/views.png", response_class=FileResponse, responses=PICTURE)
def scan_views(site: Here, id: ThingId) -> FileResponse:
    """The mesh from four sides."""
    return file_response(one_of(scan_of(site.library, id), VIEWS), VIEWS)


@scan_router.get("/objects/{id}/scan/outline.png", response_class=FileResponse, responses=PICTURE)
def scan_outline(site: Here, id: ThingId) -> FileResponse:
    """Its outline, and the box that it was looked for in, on two of the film's pictures."""
    return file_response(one_of(scan_of(site.library, id), OUTLINE), OUTLINE)


@scan_router.get("/rooms/{id}/scene", response_class=FileResponse, responses=SCENE_REPLY)
async def room_scene(site: Here, id: ThingId) -> FileResponse:
    """The room's mesh that was brought, or that lies in a session, as the viewer shows it."""
    shelf = site.library.shelf_of(id, "session", "material")
    scene = shelf.cache(id) / f"scene-{cache_key('room')}.bin"
    if not scene.is_file():
        await site.sandbox.run(sandboxed_work.pack_room_scene, shelf.content(id), scene)
    return FileResponse(scene, media_type=SCENE)


picture_router = APIRouter(prefix="/api", tags=["pictures"])
_LATER = "picture-later"
_REPLY = binary(f"A picture; 404 with the code {_LATER} while it is drawn.", "image/webp")


@picture_router.get("/results/{id}/picture", response_class=FileResponse, responses=_REPLY)
async def of_result(site: Here, id: ThingId) -> FileResponse:
    """The person and the object, in the middle of the motion."""
    folder = site.library.results.content(id)
    later = site.library.results.cache(id) / f"poster-{cache_key(folder)}.webp"
    return _drawn(site, [later], sandboxed_work.draw_result, folder)


@picture_router.get("/sessions/{id}/picture", response_class=FileResponse, responses=_REPLY)
async def of_session(site: Here, id: ThingId, said: Asked) -> FileResponse:
    """The object with the phone on it, as the session moves them; 404 where that is not known."""
    inputs = seen_with(site.library, id, said)
    if inputs.mesh is None:
        raise _no_picture(id)
    later = site.library.shelves["session"].cache(id) / f"take-{cache_key('take', inputs)}.webp"
    if later.is_file() and not later.stat().st_size:
        raise _no_picture(id)
    return _drawn(site, [later], sandboxed_work.draw_take, inputs)


def _no_picture(id_: str) -> Refused:
    return Refused(
        404,
        "picture-none",
        "There is no picture: the object is not given, or the recording gives no motion of it.",
        where=id_,
        fix="Give the object and its mount; the report says what is wrong with a recording.",
    )


@picture_router.get("/objects/{id}/picture", response_class=FileResponse, responses=_REPLY)
async def of_object(site: Here, id: ThingId) -> FileResponse:
    """The object from in front and above."""
    mesh_file = mesh_file_of(site.library, id)
    shelf = site.library.shelves["object"]
    later = shelf.cache(id) / f"poster-{cache_key(mesh_file)}.webp"
    made = shelf.folder / id / POSTER
    return _drawn(site, [made, later], sandboxed_work.draw_object, mesh_file.path, mesh_file.scale)


@picture_router.get("/mounts/{id}/picture", response_class=FileResponse, responses=_REPLY)
async def of_mount(site: Here, id: ThingId) -> FileResponse:
    """The phone on its object."""
    mount, mesh_file = _mounted(site, id)
    shelf = site.library.shelves["mount"]
    later = shelf.cache(id) / f"poster-{cache_key(mesh_file)}.webp"
    made = shelf.folder / id / POSTER
    return _drawn(
        site, [made, later], sandboxed_work.draw_mount, mount, mesh_file.path, mesh_file.scale
    )


_POSTERS = {"results": of_result, "objects": of_object, "mounts": of_mount}
Picture = Annotated[
    str,
    StringConstraints(
        pattern=r"^(results|objects|mounts|sessions)/[0-9a-f]{16}/picture(\?[^#]{0,400})?$"
    ),
]
Pictures = Annotated[
    list[Picture],
    Query(
        max_length=100,
        description='Addresses of pictures behind /api/, such as "results/ID/picture".',
    ),
]


@picture_router.get("/pictures")
async def states(site: Here, of: Pictures) -> dict[str, Literal["ready", "later", "none"]]:
    """Which pictures are there, which are being drawn now, and which there will never be."""
    return {address: await _state(site, address) for address in of}


async def _state(site: Site, address: str) -> Literal["ready", "later", "none"]:
    path, _, query = address.partition("?")
    kind, id_, _ = path.split("/")
    try:
        if kind == "sessions":
            await of_session(site, id_, ReadAs.model_validate(dict(parse_qsl(query))))
        else:
            await _POSTERS[kind](site, id_)
    except (InputError, ValidationError) as error:
        return "later" if isinstance(error, InputError) and error.code == _LATER else "none"
    return "ready"


def _drawn(site: Site, places: Sequence[Path], draw: Work, *given: Any) -> FileResponse:
    """The poster at the first place that has one; where none has, it is drawn at the last, for later.

    Raises:
        Refused: 404 while there is none.
    """
    for path in places:
        if path.is_file():
            return file_response(path, "poster.webp")
    # A list of many would take all the connections of a browser.
    asyncio.ensure_future(site.painter.run(draw, *given, places[-1])).add_done_callback(_forget)
    raise Refused(
        404,
        _LATER,
        "The picture is being drawn.",
        fix="Ask again in some seconds.",
    )


def _forget(drawn: asyncio.Future[dict[str, Any]]) -> None:
    """Note why something cannot be drawn in the server's log; it has no picture."""
    if not drawn.cancelled():
        drawn.exception()


@picture_router.get("/mounts/{id}/scene", response_class=FileResponse, responses=SCENE_REPLY)
async def mount_scene(site: Here, id: ThingId) -> FileResponse:
    """The phone on its object, as the viewer shows it."""
    mount, mesh_file = _mounted(site, id)
    scene = site.library.shelves["mount"].cache(id) / f"scene-{cache_key('scene', mesh_file)}.bin"
    if not scene.is_file():
        await site.sandbox.run(
            sandboxed_work.pack_mount_scene, mount, mesh_file.path, mesh_file.scale, scene
        )
    return FileResponse(scene, media_type=SCENE)


def _mounted(site: Site, id_: str) -> tuple[Path, MeshFile]:
    """A mount's file and its object.

    Raises:
        Refused: 404 when it is not there, or its object is not known, or gone.
    """
    shelf = site.library.shelves["mount"]
    object_ = shelf.get(id_).facts.get("object")
    if object_ is None:
        raise Refused(
            404,
            "mount-object",
            "It is not known which object of the library this mount is for.",
            where=id_,
            fix="A mount that is found here is shown on its object.",
        )
    return shelf.content(id_), mesh_file_of(site.library, object_)
