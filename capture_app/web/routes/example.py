"""The take that comes with the program, as if somebody had brought it."""

import shutil
from pathlib import Path
from typing import Any

from fastapi import APIRouter

from capture_app.commands.inputs import ItemKind
from capture_app.library_item import FILES, Info, mesh_summary, mount_summary
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from capture_app.web.library.folders import keep_tree
from capture_app.web.site import Here, Site

router = APIRouter(prefix="/api/example", tags=["example"])

_THINGS: dict[ItemKind, tuple[str, str]] = {
    "session": ("e0e0e0e0e0e0e001", SESSION),
    "object": ("e0e0e0e0e0e0e002", MESH),
    "mount": ("e0e0e0e0e0e0e003", MOUNT),
}
"""Ids that are always the same, so that there is never a second one."""


@router.post("")
async def example(site: Here) -> dict[str, str]:
    """Put the example into the library, unless it is there."""
    facts: dict[ItemKind, dict[str, Any]] = {
        "session": {},
        "object": {"mesh": MESH, **await site.sandbox.run(mesh_summary, DEMO / MESH, 1.0)},
        "mount": await site.sandbox.run(mount_summary, DEMO / MOUNT),
    }
    facts["mount"]["object"] = _THINGS["object"][0]
    for kind, (id_, name) in _THINGS.items():
        if not (site.library.shelves[kind].folder / id_).is_dir():
            _copy(site, kind, id_, DEMO / name, facts[kind])
    return {kind: id_ for kind, (id_, _) in _THINGS.items()}


def _copy(site: Site, kind: ItemKind, id_: str, source: Path, facts: dict[str, Any]) -> None:
    staging = site.library.scratch / id_
    shutil.rmtree(staging, ignore_errors=True)
    target = staging / FILES / source.name
    target.parent.mkdir(parents=True)
    (shutil.copytree if source.is_dir() else shutil.copy)(source, target)
    keep_tree(staging)
    files = [p for p in staging.rglob("*") if p.is_file()]
    size = sum(p.stat().st_size for p in files)
    info = Info(name=f"Example: {source.stem}", size=size, files=len(files), facts=facts)
    site.library.shelves[kind].put(id_, info, staging)
