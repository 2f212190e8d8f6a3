"""POST /api/mounts: a mount that needs no recording, from a form."""

import shutil
from typing import Annotated, Any

from fastapi import APIRouter, Body

from capture_app.commands.calibrate import DrawingWay, HandWay, PointsWay
from capture_app.library_item import FILES, Info, mount_summary
from capture_app.web.by_id import with_paths
from capture_app.web.library.ids import new_id
from capture_app.web.routes.items import LibraryItem, item
from capture_app.web.routes.mount_forms import IdentityForm, MountForm, PointsForm
from capture_app.web.sandbox import mounts
from capture_app.web.site import Here, Site
from capture_app.web.sources import mesh_file_of

router = APIRouter(prefix="/api/mounts", tags=["mounts"])


@router.post("", status_code=201)
async def calibrate(site: Here, given: Annotated[MountForm, Body()]) -> LibraryItem:
    """Make a mount from a form: it is written in a folder of its own, which then goes to the others."""
    id_ = new_id()
    folder = site.library.scratch / id_
    target = folder / FILES / "mount.json"
    target.parent.mkdir(parents=True)
    try:
        if isinstance(given, IdentityForm):
            found = await site.sandbox.run(mounts.identity, target)
        else:
            found = await site.sandbox.run(mounts.by_hand, target, _way(site, id_, given))
        facts: dict[str, Any] = {**await site.sandbox.run(mount_summary, target), **found}
        facts["object"] = getattr(given, "object", None)
        info = Info(name=given.name, size=target.stat().st_size, files=1, facts=facts)
        site.library.shelves["mount"].put(id_, info, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return item(id_, info)


def _way(site: Site, id_: str, given: MountForm) -> HandWay:
    """Return what a form says, with the path of the object in place of its id."""
    way = PointsWay if isinstance(given, PointsForm) else DrawingWay
    said = with_paths(site.library, id_, given, way)
    if (object_ := said.pop("object", None)) is not None:
        mesh_file = mesh_file_of(site.library, object_)
        said |= {"object": mesh_file.path, "mesh_scale": mesh_file.scale}
    return way.model_validate(said)
