"""Results: what they are made of and hold, and their files."""

import json
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi import Path as PathParameter
from fastapi.responses import FileResponse, Response
from pydantic import ConfigDict, Field

from capture_app.commands.inputs import DescribedModel, Sample
from capture_app.commands.run import VIDEO
from capture_app.jobs.job_record import OVER
from capture_app.library_item import Info
from capture_app.manifest import CONTACTS, MANIFEST, Manifest, read_manifest
from capture_app.motion_arrays import unsolved_samples
from capture_app.replay import PACK_VERSION
from capture_app.web import sandboxed_work
from capture_app.web.file_response import (
    DOWNLOAD,
    FILE,
    ResultFile,
    binary,
    cache_key,
    file_name,
    file_response,
    listed,
    one_of,
)
from capture_app.web.problems import Refused
from capture_app.web.routes.items import LibraryItem, Rename, item, refuse_in_use, renamed
from capture_app.web.routes.orders import OtherContacts
from capture_app.web.routes.reports import SCENE, SCENE_REPLY
from capture_app.web.sandbox_process import Work
from capture_app.web.site import Here, Site, ThingId
from omomo_core.errors import InputError
from omomo_core.motion import FPS

router = APIRouter(prefix="/api/results", tags=["results"])
_PAGE = binary("A page of HTML, to be saved.", DOWNLOAD)
_ORIGINS = ("session", "object", "mount", "parent")
"""Ids of what a result was made from; null for one that was copied in."""


Solved = Annotated[
    tuple[Annotated[int, Field(ge=1, le=64)], ...],
    Query(description="Samples that are to be solved in it, counted from 1."),
]


FileName = Annotated[str, PathParameter(description="Name of the file, as the result lists it.")]


class Whole(DescribedModel):
    """A result with its manifest and all its files."""

    model_config = ConfigDict(extra="allow")

    id: str
    """16 hex digits, those of the job that made it."""
    name: str
    """What people call it."""
    created: datetime
    """When it was made, UTC."""
    size: int
    """Bytes of all its files."""
    manifest: dict[str, Any]
    """Its manifest.json: versions, seed, inputs, options, scores and findings."""
    files: list[ResultFile]
    """What lies in its folder."""
    exports: list[ResultFile]
    """Files and videos that were made of it."""
    unsolved: list[int]
    """Samples that are as they were sampled, counted from 1; the scene solves them when it is asked to."""
    video_job: str | None
    """Id of the job that draws its video; null when that is over."""


@router.get("")
def list_(site: Here) -> list[LibraryItem]:
    """All there are, the newest first."""
    return [_item(site, id_, info) for id_, info in site.library.results.list()]


@router.get("/{id}")
def get(site: Here, id: ThingId) -> Whole:
    """What is known of one, with its manifest and all its files."""
    results = site.library.results
    manifest = read_manifest(results.content(id) / MANIFEST).model_dump(mode="json")
    for given in manifest["inputs"]:
        given["path"] = site.library.shown(given["path"])
    at = f"/api/results/{id}"
    fields = _item(site, id, results.get(id)).model_dump()
    return Whole(
        **{k: v for k, v in fields.items() if k != "files"},
        manifest=manifest,
        files=listed(results.place(id), f"{at}/files"),
        exports=listed(results.exports(id), f"{at}/exports"),
        unsolved=[k + 1 for k in sorted(unsolved_samples(results.content(id)))],
        video_job=_video_job(site, id),
    )


@router.patch("/{id}")
def rename(site: Here, id: ThingId, given: Rename) -> LibraryItem:
    """Give it another name."""
    return _item(site, id, site.library.results.change(id, renamed(given.name)))


@router.delete("/{id}", status_code=204)
def delete(site: Here, id: ThingId) -> None:
    """Delete one with all that was made of it; not while a job needs it."""
    site.library.results.get(id)
    refuse_in_use(site, id)
    site.library.results.remove(id)


@router.get("/{id}/contacts")
def contacts(site: Here, id: ThingId) -> Response:
    """Which hand holds the object when and where, to be corrected."""
    path = site.library.results.content(id) / CONTACTS
    if not path.is_file():
        raise Refused(
            404,
            "contacts-missing",
            "This result has no contacts to correct.",
            where=id,
            fix="Run the take again with the contact rule 'segments'.",
        )
    return Response(path.read_bytes(), media_type="application/json")


@router.get("/{id}/files/{name}", response_class=FileResponse, responses=FILE)
def file(site: Here, id: ThingId, name: FileName) -> FileResponse:
    """One of its files."""
    return _served(site, id, one_of(site.library.results.content(id), name))


@router.get("/{id}/exports/{name}", response_class=FileResponse, responses=FILE)
def export(site: Here, id: ThingId, name: FileName) -> FileResponse:
    """A file that was made of it."""
    site.library.results.get(id)
    return _served(site, id, one_of(site.library.results.exports(id), name))


@router.get("/{id}/scene", response_class=FileResponse, responses=SCENE_REPLY)
async def scene(site: Here, id: ThingId, solved: Solved = ()) -> FileResponse:
    """The result as the viewer plays it, without what the phone filmed: that takes longer to be read."""
    if solved:
        folder = site.library.results.content(id)
        await site.sandbox.run(sandboxed_work.solve_samples, folder, solved)
    return await _packed(site, id, "motion", sandboxed_work.pack_result_scene)


@router.post("/{id}/scene", response_class=Response, responses=SCENE_REPLY)
async def try_contacts(site: Here, id: ThingId, given: OtherContacts) -> Response:
    """The people of its scene as they are with other contacts; the result stays as it is."""
    said = (json.dumps(given.contacts, allow_nan=False), given.sample)
    with TemporaryDirectory(dir=site.library.scratch) as scratch:
        scene = Path(scratch, "people.bin")
        folder = site.library.results.content(id)
        await site.sandbox.run(sandboxed_work.try_contacts, folder, *said, scene)
        return Response(scene.read_bytes(), media_type=SCENE)


@router.get("/{id}/film", response_class=FileResponse, responses=SCENE_REPLY)
async def film(site: Here, id: ThingId) -> FileResponse:
    """What the phone filmed during the result, as the viewer shows it; empty where it filmed nothing."""
    return await _packed(site, id, "film", sandboxed_work.pack_result_film)


async def _packed(site: Site, id_: str, name: str, pack: Work) -> FileResponse:
    folder = site.library.results.content(id_)
    # Samples that are solved later stand in the folder, too.
    later = sorted(path.name for path in folder.glob("sample_*.npz"))
    path = site.library.results.cache(id_) / f"{name}-{cache_key(folder, PACK_VERSION, *later)}.bin"
    if not path.is_file():
        await site.sandbox.run(pack, folder, path)
    return FileResponse(path, media_type=SCENE)


@router.get("/{id}/share.html", response_class=FileResponse, responses=_PAGE)
async def share(site: Here, id: ThingId, sample: Annotated[Sample, Query()] = None) -> FileResponse:
    """The result as one page that plays anywhere, to be saved; it opens on the sample, from 1."""
    name = site.library.results.get(id).name
    folder = site.library.results.content(id)
    path = site.library.results.cache(id) / f"share-{cache_key(folder, name, sample)}.html"
    if not path.is_file():
        await site.sandbox.run(sandboxed_work.share_result, folder, name, sample, path)
    return file_response(path, f"{file_name(name)}.html")


def _video_job(site: Site, id_: str) -> str | None:
    """The job that draws the video; a result that a job made has the job's id."""
    made = site.queue.get(id_)
    video = made and site.queue.get(made.summary.get("video_job", ""))
    return video.id if video and video.state not in OVER else None


def _served(site: Site, id_: str, path: Path) -> FileResponse:
    name = file_name(site.library.results.get(id_).name)
    return file_response(path, f"{name}-{path.name}")


def _item(site: Site, id_: str, info: Info) -> LibraryItem:
    folder = site.library.results.place(id_)
    video = f"/api/results/{id_}/files/{VIDEO}" if (folder / VIDEO).is_file() else None
    facts = {
        **dict.fromkeys(_ORIGINS),
        **info.facts,
        **_of_manifest(folder),
        "video": video,
    }
    return item(id_, info.model_copy(update={"facts": facts}))


def _of_manifest(folder: Path) -> dict[str, Any]:
    """Its headline; a manifest of another version says nothing here."""
    try:
        manifest: Manifest = read_manifest(folder / MANIFEST)
    except InputError:
        return {}
    mesh = next((Path(i.path).stem for i in manifest.inputs if i.role == "object"), None)
    return {
        "seconds": round((manifest.segment.stop - manifest.segment.start) / FPS, 3),
        "samples": len(manifest.scores),
        "chosen": manifest.chosen,
        "object_name": mesh,
        "findings": [finding.sentence for finding in manifest.findings],
        "notes": manifest.notes,
        "faults": manifest.faults,
        "grips": manifest.grips,
    }
