"""Uploads: announced, sent piece by piece, gone on with after any cut, and finished."""

import asyncio
from typing import Annotated, Any

from fastapi import APIRouter, Body, Path, Query, Request
from pydantic import BaseModel, Field
from starlette.requests import ClientDisconnect

from capture_app.commands.inputs import ItemKind
from capture_app.library_item import Name
from capture_app.web.finish_upload import check_announced, finish_upload
from capture_app.web.library.ids import Id
from capture_app.web.library.uploads import Announced, Upload
from capture_app.web.problems import Refused
from capture_app.web.site import Here, Site


class Begin(BaseModel):
    """Files that shall come."""

    kind: ItemKind
    name: Name
    files: list[Announced]

    model_config = {
        "json_schema_extra": {
            "examples": [
                {
                    "kind": "session",
                    "name": "chair, first take",
                    "files": [{"path": "take/odometry.csv", "size": 48213}],
                }
            ]
        }
    }


class Finish(BaseModel):
    """How to read what came."""

    scale: float = Field(1.0, gt=0, le=1000, allow_inf_nan=False)
    """Of an object: the factor that brings it to metres."""

    model_config = {"json_schema_extra": {"examples": [{"scale": 0.01}]}}


class Received(BaseModel):
    """How much of a file is on the server's disk."""

    received: int


class Adopted(BaseModel):
    """What an upload became."""

    kind: ItemKind
    id: str


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
def unfinished(site: Here) -> list[dict[str, Any]]:
    """The uploads that are not finished, the newest first."""
    uploads = site.library.uploads
    return [
        {**_head(id_, upload, uploads.received(id_, upload)), "count": len(upload.files)}
        for id_, upload in uploads.list()
    ]


@router.get("/{id}")
def progress(site: Here, id: Id) -> dict[str, Any]:
    """How much of each file has arrived: where to go on."""
    return _whole(site, id)


@router.put("/{id}/files/{index}", openapi_extra=_RAW)
async def receive(
    site: Here,
    request: Request,
    id: Id,
    index: Annotated[int, Path(ge=0, lt=2**31)],
    offset: Annotated[int, Query(ge=0, lt=2**53)],
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
    site: Here, id: Id, given: Annotated[Finish, Body(default_factory=lambda: Finish(scale=1.0))]
) -> Adopted:
    """Turn a whole upload into what it is; when that fails it is kept."""
    return Adopted(kind=await finish_upload(site, id, given.scale), id=id)


@router.delete("/{id}", status_code=204)
def abandon(site: Here, id: Id) -> None:
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
