"""Posters of results, objects and mounts: as the job drew them, or drawn when first asked for."""

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fastapi import APIRouter
from fastapi.responses import FileResponse

from capture_app.commands.inputs import MeshFile
from capture_app.library_item import PICTURE
from capture_app.web.cache import key
from capture_app.web.file_response import file_response
from capture_app.web.library.ids import Id
from capture_app.web.problems import Refused
from capture_app.web.routes.reports import SCENE, SCENE_REPLY
from capture_app.web.sandbox import drawing, work
from capture_app.web.sandbox.child_process import Work
from capture_app.web.site import Here, Site
from capture_app.web.sources import mesh_file_of

router = APIRouter(prefix="/api", tags=["pictures"])
_REPLY: dict[int | str, dict[str, object]] = {200: {"content": {"image/webp": {}}}}


@router.get("/results/{id}/picture", response_class=FileResponse, responses=_REPLY)
async def of_result(site: Here, id: Id) -> FileResponse:
    """The person and the object, in the middle of the motion."""
    folder = site.library.results.content(id)
    later = site.library.results.cache(id) / f"poster-{key(folder)}.webp"
    return _drawn(site, [later], drawing.draw_result, folder)


@router.get("/objects/{id}/picture", response_class=FileResponse, responses=_REPLY)
async def of_object(site: Here, id: Id) -> FileResponse:
    """The object from in front and above."""
    mesh_file = mesh_file_of(site.library, id)
    shelf = site.library.shelves["object"]
    later = shelf.cache(id) / f"poster-{key(mesh_file)}.webp"
    made = shelf.folder / id / PICTURE
    return _drawn(site, [made, later], drawing.draw_object, mesh_file.path, mesh_file.scale)


@router.get("/mounts/{id}/picture", response_class=FileResponse, responses=_REPLY)
async def of_mount(site: Here, id: Id) -> FileResponse:
    """The phone on its object."""
    mount, mesh_file = _mounted(site, id)
    shelf = site.library.shelves["mount"]
    later = shelf.cache(id) / f"poster-{key(mesh_file)}.webp"
    made = shelf.folder / id / PICTURE
    return _drawn(site, [made, later], drawing.draw_mount, mount, mesh_file.path, mesh_file.scale)


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
        "picture-later",
        "The picture is being drawn.",
        fix="Ask again in some seconds.",
    )


def _forget(drawn: asyncio.Future[dict[str, Any]]) -> None:
    """What cannot be drawn has no picture; why, is in the server's log."""
    if not drawn.cancelled():
        drawn.exception()


@router.get("/mounts/{id}/scene", response_class=FileResponse, responses=SCENE_REPLY)
async def mount_scene(site: Here, id: Id) -> FileResponse:
    """The phone on its object, as the viewer shows it."""
    mount, mesh_file = _mounted(site, id)
    scene = site.library.shelves["mount"].cache(id) / f"scene-{key('scene', mesh_file)}.bin"
    if not scene.is_file():
        await site.sandbox.run(work.pack_mount_scene, mount, mesh_file.path, mesh_file.scale, scene)
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
