"""Uploads: announced, sent piece by piece, gone on with after any cut, and finished.

A whole upload becomes a session, an object, a mount, a video or a list of contacts.
"""

import asyncio
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Body, Query, Request
from fastapi import Path as PathParameter
from pydantic import ConfigDict, Field
from starlette.requests import ClientDisconnect

from capture_app.commands.inputs import DescribedModel, ItemKind
from capture_app.library_item import FILES, Info, Name, mesh_summary, mount_summary
from capture_app.web import sandboxed_work
from capture_app.web.problems import Refused
from capture_app.web.shelves import content_of
from capture_app.web.site import Here, Site, ThingId
from capture_app.web.unfinished_uploads import Announced, Upload
from ingest.mesh import FORMATS
from omomo_core.errors import InputError

VIDEOS = (".mp4", ".mov", ".m4v")
_ENDINGS: dict[ItemKind, tuple[str, ...]] = {
    "video": VIDEOS,
    "mount": (".json",),
    "contacts": (".json",),
}


def check_announced(upload: Upload, site: Site) -> None:
    """Refuse what is too much, or is nothing of its kind, before any of it is sent.

    Raises:
        Refused: 413, or 507 when the disk has no room.
        InputError: "upload-files": too few or too many files, or of another kind.
    """
    limits = site.limits
    most = {"object": limits.mesh, "mount": limits.small, "contacts": limits.small}
    most_of_one = min(limits.file, most.get(upload.kind, limits.file))
    largest = max((file.size for file in upload.files), default=0)
    for found, bound, what in (
        (len(upload.files), limits.files, "files"),
        (largest, most_of_one, "bytes in one file"),
        (upload.size, limits.upload, "bytes"),
    ):
        if found > bound:
            raise Refused(
                413,
                "upload-too-large",
                f"The upload has {found:,} {what}; at most {bound:,} are taken.",
                fix="Bring less at once.",
            )
    _check_files(upload)
    if upload.size + limits.spare > site.library.free:
        raise Refused(
            507,
            "disk-full",
            f"The upload needs {upload.size / 1e9:.2f} GB; the disk has "
            f"{site.library.free / 1e9:.2f} GB left.",
            fix="Delete what is not needed any more, or make room on the disk.",
        )


def _check_files(upload: Upload) -> None:
    names = [file.path for file in upload.files]
    if upload.kind == "object":
        main_mesh(upload)
    elif not names or (upload.kind in _ENDINGS and len(names) > 1):
        raise _files("Exactly one file is needed." if names else "There are no files in it.")
    endings = _ENDINGS.get(upload.kind)
    if endings and not names[0].lower().endswith(endings):
        raise _files(f"{names[0]!r:.90} is of another kind: {', '.join(endings)} is needed.")


def main_mesh(upload: Upload) -> str:
    """The mesh among an object's files; others are its materials and textures.

    Raises:
        InputError: "upload-files": there is none, or more than one.
    """
    found = [file.path for file in upload.files if file.path.lower().endswith(FORMATS)]
    if len(found) != 1:
        raise _files(f"It has {len(found)} meshes ({', '.join(FORMATS)}); one is needed.")
    return found[0]


def _files(what: str) -> InputError:
    return InputError("upload-files", what, fix="Choose the files again.")


async def finish_upload(site: Site, id_: str, scale: float) -> ItemKind:
    """Put a whole upload on its shelf; who asks again after that gets the same answer.

    Args:
        site: where it is.
        id_: the upload's, which becomes the thing's.
        scale: factor that brings an object to metres.

    Raises:
        Refused: 404, or 409 while files are missing.
        InputError: a mesh or a mount is no good, or no reader finds a recording; the upload is kept.
    """
    for kind, shelf in site.library.shelves.items():
        if (shelf.folder / id_).is_dir():
            return kind
    upload = site.library.uploads.get(id_)
    folder = site.library.uploads.complete(id_, upload)
    facts = await _facts(site, upload, folder / FILES, scale)
    info = Info(name=upload.name, size=upload.size, files=len(upload.files), facts=facts)
    site.library.shelves[upload.kind].put(id_, info, folder)
    return upload.kind


async def _facts(site: Site, upload: Upload, files: Path, scale: float) -> dict[str, Any]:
    if upload.kind == "object":
        mesh = main_mesh(upload)
        return {"mesh": mesh, **await site.sandbox.run(mesh_summary, files / mesh, scale)}
    if upload.kind == "mount":
        found = await site.sandbox.run(mount_summary, files / upload.files[0].path)
        return {**found, "object": None}
    if upload.kind == "session":
        await _check_session(site, content_of(files))
    return {}


async def _check_session(site: Site, recording: Path) -> None:
    """Refuse what is no recording; one that is damaged is kept, and its report says so."""
    try:
        await site.sandbox.run(sandboxed_work.check_session, recording)
    except InputError as error:
        if error.code == "session-unknown":
            raise


class Begin(DescribedModel):
    """Files that shall come."""

    kind: ItemKind
    """What they are; "material" is whatever else a calibration or a scan reads."""
    name: Name
    """What to call the thing."""
    files: list[Announced]
    """All its files, in the order by which they are numbered from 0."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "kind": "session",
                    "name": "chair, first take",
                    "files": [{"path": "take/odometry.csv", "size": 48213}],
                }
            ]
        }
    )


class Finish(DescribedModel):
    """How to read what came."""

    scale: float = Field(1.0, gt=0, le=1000, allow_inf_nan=False)
    """Factor that brings an object's mesh to metres."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"scale": 0.01}]})


class Received(DescribedModel):
    """How much of a file is on the server's disk."""

    received: int
    """Bytes, from its beginning."""


class Adopted(DescribedModel):
    """What an upload became."""

    kind: ItemKind
    """What it is."""
    id: str
    """Its id in the library: that of the upload."""


PATH = "/api/uploads"
router = APIRouter(prefix=PATH, tags=["uploads"])
_RAW = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}


@router.post("", status_code=201)
def begin(site: Here, given: Begin) -> dict[str, Any]:
    """Announce the files of a session, an object, a mount, a video or a list of contacts."""
    upload = Upload(kind=given.kind, name=given.name, files=given.files)
    check_announced(upload, site)
    return _whole(site, site.library.uploads.begin(upload.kind, upload.name, upload.files))


@router.get("")
def list_(site: Here) -> list[dict[str, Any]]:
    """The uploads that are not finished, the newest first."""
    uploads = site.library.uploads
    return [
        {**_head(id_, upload, uploads.received(id_, upload)), "count": len(upload.files)}
        for id_, upload in uploads.list()
    ]


@router.get("/{id}")
def get(site: Here, id: ThingId) -> dict[str, Any]:
    """How much of each file has arrived: where to go on."""
    return _whole(site, id)


@router.put("/{id}/files/{index}", openapi_extra=_RAW)
async def receive(
    site: Here,
    request: Request,
    id: ThingId,
    index: Annotated[int, PathParameter(ge=0, lt=2**31, description="Number of the file, from 0.")],
    offset: Annotated[int, Query(ge=0, lt=2**53, description="Bytes that are there already.")],
) -> Received:
    """Send a piece of a file, to go behind what is there."""
    try:
        return await _receive(site, request, id, index, offset)
    except (Refused, OSError) as error:
        if not isinstance(error, ClientDisconnect):
            await _drain(request, site.limits.chunk)
        raise


@router.post("/{id}/finish")
async def finish(
    site: Here,
    id: ThingId,
    given: Annotated[Finish, Body(default_factory=lambda: Finish(scale=1.0))],
) -> Adopted:
    """Turn a whole upload into what it is; when that fails it is kept."""
    return Adopted(kind=await finish_upload(site, id, given.scale), id=id)


@router.delete("/{id}", status_code=204)
def delete(site: Here, id: ThingId) -> None:
    """Take an upload away."""
    site.library.uploads.remove(id)


async def _receive(site: Site, request: Request, id_: str, index: int, offset: int) -> Received:
    length = _length(request)
    uploads = site.library.uploads
    upload = await asyncio.to_thread(uploads.get, id_)
    place = uploads.place(id_, upload, index)
    if length > site.limits.chunk or offset + length > upload.files[index].size:
        most = min(site.limits.chunk, max(upload.files[index].size - offset, 0))
        raise Refused(
            413,
            "chunk-too-large",
            f"{length:,} bytes are more than the {most:,} that may come here.",
            where=f"{id_}/{index} at {offset}",
            fix="Send less at once, and not more than was announced.",
        )
    have = await site.receiver.append(place, offset, length, request.stream())
    uploads.touch(id_)
    return Received(received=have)


def _length(request: Request) -> int:
    given = request.headers.get("content-length")
    if given is None:
        raise Refused(
            411,
            "length-required",
            "The request does not say how long it is.",
            where="Content-Length",
            fix="Send the piece with its length, and not chunked.",
        )
    if not given.isascii() or not given.isdigit():
        raise Refused(400, "length-malformed", "The length is no number.", where="Content-Length")
    return int(given)


async def _drain(request: Request, most: int) -> None:
    """Read what still comes, or the client sees a broken connection and not the answer."""
    left = most
    try:
        async for piece in request.stream():
            left -= len(piece)
            if left < 0:
                return
    except (ClientDisconnect, RuntimeError):
        return


def _whole(site: Site, id_: str) -> dict[str, Any]:
    upload = site.library.uploads.get(id_)
    received = site.library.uploads.received(id_, upload)
    files = [
        {"index": k, "path": file.path, "size": file.size, "received": have}
        for k, (file, have) in enumerate(zip(upload.files, received, strict=True))
    ]
    return {**_head(id_, upload, received), "files": files}


def _head(id_: str, upload: Upload, received: list[int]) -> dict[str, Any]:
    return {
        "id": id_,
        "kind": upload.kind,
        "name": upload.name,
        "created": upload.created,
        "size": upload.size,
        "received": sum(received),
    }
