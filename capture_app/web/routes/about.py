"""The server itself: how it is, what it offers, who may come in; and the take that comes with the program."""

import shutil
from collections.abc import Callable
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Request
from fastapi.responses import Response
from pydantic import ConfigDict, Field

from capture_app.commands.export import Bones, ExportFormat
from capture_app.commands.inputs import DescribedModel, ItemKind
from capture_app.exports.export_formats import FORMATS
from capture_app.exports.fbx import has_blender
from capture_app.library_item import FILES, Info, mesh_summary, mount_summary
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from capture_app.web.problems import Refused
from capture_app.web.routes.orders import RunOptions
from capture_app.web.shelves import keep_tree
from capture_app.web.site import Here, Limits, Site
from ingest.calibration.phone_body import MODELS, Model
from ingest.formats.registry import FORMATS as LOGS

_FPS = (24, 25, 30, 50, 60)
_VIEWS = ("third", "orbit", "follow", "top", "object", "hands")


class Login(DescribedModel):
    """What the server printed when it was started."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"token": "printed-at-the-start"}]})

    token: Annotated[str, Field(max_length=1000)]
    """The token itself."""


def routes(worker_runs: Callable[[], bool]) -> APIRouter:
    """The routes.

    Args:
        worker_runs: tells whether a worker of this server is there to do jobs.
    """
    router = APIRouter(prefix="/api", tags=["server"])

    @router.get("/health")
    def health(site: Here) -> dict[str, Any]:
        """Whether jobs are done, how much room there is, and what may be sent."""
        return {
            "version": version("omocap"),
            "worker": worker_runs(),
            "free_bytes": site.library.free,
            "limits": _told(site.limits),
        }

    router.get("/choices")(choices)
    router.post("/login", status_code=204, openapi_extra={"security": [{}]})(login)
    assert health
    return router


def choices() -> dict[str, Any]:
    """What can be chosen in the forms of a page."""
    sides = [f"{v} {h}" for v in ("top", "middle", "bottom") for h in ("left", "middle", "right")]
    named = [side.replace("middle middle", "centre") for side in sides]
    return {
        "phones": [_phone(name, model) for name, model in MODELS.items()],
        "phone_points": [
            "lens",
            *(f"{side} {face}" for face in ("back", "front") for side in named),
        ],
        "exports": [
            {"to": kind.value, "ending": f.endings[0], "ups": f.ups, "units": f.units}
            for kind, f in FORMATS.items()
            if kind is not ExportFormat.fbx or has_blender()
        ],
        "bones": [bones.value for bones in Bones],
        "fps": _FPS,
        "views": _VIEWS,
        "contact": ("segments", "paper"),
        "formats": [format_.NAME for format_ in LOGS],
        "run": RunOptions().model_dump(),
    }


def _phone(name: str, model: Model) -> dict[str, Any]:
    """A model for a form: its body in millimetres, and whether the place of its lens is known."""
    width, height, _ = model.body
    return {"name": name, "width": width, "height": height, "lens_known": model.lens is not None}


def login(request: Request, site: Here, given: Login) -> Response:
    """Let a browser in that knows the token."""
    answer = Response(status_code=204)
    if site.token is None:
        return answer
    if not site.token.fits(given.token):
        raise Refused(
            401,
            "token-wrong",
            "This is not the token.",
            fix="Copy it from where the server was started.",
        )
    return site.token.remember(request, answer)


def _told(limits: Limits) -> dict[str, Any]:
    told = {f"{name}_bytes": value for name, value in asdict(limits).items()}
    names = ("chunk_bytes", "file_bytes", "upload_bytes", "mesh_bytes", "small_bytes")
    return {**{name: told[name] for name in names}, "files": limits.files}


example_router = APIRouter(prefix="/api/example", tags=["example"])

_THINGS: dict[ItemKind, tuple[str, str]] = {
    "session": ("e0e0e0e0e0e0e001", SESSION),
    "object": ("e0e0e0e0e0e0e002", MESH),
    "mount": ("e0e0e0e0e0e0e003", MOUNT),
}
"""Ids that are always the same, so that there is never a second one."""


@example_router.post("")
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
