"""Mounts that need no file: the phone is the object, a drawing's numbers, points that were clicked."""

import shutil
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Body
from pydantic import BaseModel, ConfigDict, Field

from capture_app.calibration.calibrate import phone_of
from capture_app.library_item import FILES, Info, Name, mount_summary
from capture_app.web.library.ids import Id, new_id
from capture_app.web.routes.items import LibraryItem, item
from capture_app.web.sandbox import mounts
from capture_app.web.site import Here, Site
from capture_app.web.sources import mesh_file_of
from ingest.calibration.drawn_mount import Drawn, Precision
from ingest.calibration.point_pairs import PointPair

router = APIRouter(prefix="/api/mounts", tags=["mounts"])

_Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e6, le=1e6)]
_Point = tuple[_Number, _Number, _Number]
_Positive = Annotated[float, Field(allow_inf_nan=False, gt=0, le=1000)]
_Words = Annotated[str, Field(max_length=200)]


def _like(**example: Any) -> ConfigDict:
    return ConfigDict(extra="forbid", json_schema_extra={"examples": [example]})


class Identity(BaseModel):
    """The phone's frame is the object's."""

    model_config = _like(method="identity", name="the phone itself")

    method: Literal["identity"]
    name: Name


class _Phone(BaseModel):
    phone: Annotated[_Words | None, Field(title="Phone")] = None
    """Its model, e.g. "iPhone 15"."""
    ruler: Annotated[
        tuple[_Positive, _Positive, _Positive, _Positive] | None, Field(title="measure its lens")
    ] = None
    """Body width and height, the lens from the top and from the right edge, millimetres."""


class Drawing(_Phone):
    """A holder's drawing says where the phone is; one of axes, euler and quaternion."""

    model_config = _like(
        method="drawing",
        name="printed holder",
        phone="iPhone 15",
        xyz=[0, 0.12, 0.31],
        axes="screen faces +y, top edge points +z",
    )

    method: Literal["drawing"]
    name: Name
    of: Literal["body", "camera"] = "body"
    xyz: Annotated[_Point, Field(title="Where it is, in the object's own axes")]
    """Where it is in the object's frame, metres."""
    point: _Words = "centre front"
    axes: Annotated[_Words | None, Field(title="How it is turned")] = None
    euler: _Words | None = None
    quaternion: tuple[_Number, _Number, _Number, _Number] | None = None
    """x y z w."""
    sigma_mm: _Positive = 1.0
    sigma_deg: Annotated[float, Field(allow_inf_nan=False, gt=0, le=180)] = 1.0
    object: Id | None = None


class ClickedPair(BaseModel):
    """A point on the phone, and the same point on the object."""

    model_config = _like(phone="top left back corner", point=[0.1, 0.22, 0.05])

    phone: _Words | _Point
    """Its name, or metres in the axes of the phone's camera."""
    point: _Point
    """Metres in the object's frame."""


class Points(_Phone):
    """Points measured on the phone and clicked on the object."""

    model_config = _like(
        method="points",
        name="clamped to the back rest",
        object="0123456789abcdef",
        phone="iPhone 15",
        pairs=[
            {"phone": "top left back corner", "point": [0.1, 0.22, 0.05]},
            {"phone": "top right back corner", "point": [0.17, 0.22, 0.05]},
            {"phone": "bottom left back corner", "point": [0.1, 0.07, 0.05]},
        ],
    )

    method: Literal["points"]
    name: Name
    object: Id
    pairs: Annotated[list[ClickedPair], Field(min_length=3, max_length=200)]
    sigma_mm: Annotated[float, Field(allow_inf_nan=False, ge=0.01, le=100)] = 2.0
    scale: bool = False
    """Solve for the scale of the mesh too."""


Calibration = Annotated[Identity | Drawing | Points, Field(discriminator="method")]


@router.post("", status_code=201)
async def calibrate(site: Here, given: Annotated[Calibration, Body()]) -> LibraryItem:
    """Make a mount from a form."""

    async def write(target: Path) -> dict[str, Any]:
        if isinstance(given, Drawing):
            return await _drawn(site, given, target)
        if isinstance(given, Points):
            return await _clicked(site, given, target)
        return await site.sandbox.run(mounts.identity, target)

    return await _shelved(site, given, write)


async def _drawn(site: Site, given: Drawing, target: Path) -> dict[str, Any]:
    drawn = Drawn(
        xyz=_spaced(given.xyz),
        axes=given.axes,
        euler=given.euler,
        quaternion=None if given.quaternion is None else _spaced(given.quaternion),
    )
    precision = Precision(given.sigma_mm / 1e3, float(np.radians(given.sigma_deg)))
    phone = phone_of(given.phone, given.ruler)
    mesh_file = None if given.object is None else mesh_file_of(site.library, given.object)
    return await site.sandbox.run(
        mounts.drawing, target, drawn, given.of, phone, given.point, precision, mesh_file
    )


async def _clicked(site: Site, given: Points, target: Path) -> dict[str, Any]:
    metres = given.sigma_mm / 1e3
    pairs = tuple(PointPair(pair.phone, pair.point, metres) for pair in given.pairs)
    phone = phone_of(given.phone, given.ruler)
    mesh_file = mesh_file_of(site.library, given.object)
    return await site.sandbox.run(mounts.points, target, pairs, phone, given.scale, mesh_file)


async def _shelved(
    site: Site,
    given: Identity | Drawing | Points,
    write: Callable[[Path], Awaitable[dict[str, Any]]],
) -> LibraryItem:
    """Write the mount in a folder of its own, which then goes to the others."""
    id_ = new_id()
    folder = site.library.scratch / id_
    target = folder / FILES / "mount.json"
    target.parent.mkdir(parents=True)
    try:
        found = await write(target)
        facts = {**await site.sandbox.run(mount_summary, target), **found}
        facts["object"] = getattr(given, "object", None)
        info = Info(name=given.name, size=target.stat().st_size, files=1, facts=facts)
        site.library.shelves["mount"].put(id_, info, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return item(id_, info)


def _spaced(numbers: tuple[float, ...]) -> str:
    return " ".join(map(repr, numbers))
