"""Mounts that need no recording, and what guides a person through a calibration that needs one.

POST /api/mounts makes a mount from a form: the phone is the object, a drawing, or clicked points. The
guide says what to do, gives boards to print, and looks at what was recorded.
"""

import shutil
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Body, Query
from fastapi.responses import FileResponse
from pydantic import Field

from capture_app.commands.calibrate import DrawingWay, HandWay, PointsWay
from capture_app.commands.inputs import DescribedModel, ShortText, Which, with_example
from capture_app.library_item import FILES, Info, Name, mount_summary
from capture_app.web import sandboxed_work
from capture_app.web.file_response import DOWNLOAD, binary, cache_key, file_response
from capture_app.web.page_words import all_in_page_words
from capture_app.web.routes.items import LibraryItem, item
from capture_app.web.routes.orders import by_id, with_paths
from capture_app.web.shelves import Id, new_id
from capture_app.web.site import Here, Site
from capture_app.web.sources import mesh_file_of
from ingest.calibration.board.board_sheet import PAPERS
from ingest.calibration.board.board_spec import PRESETS

_LEFT_OUT = ("mesh_scale", "format")
"""The library knows the unit of a mesh, and there is no log."""


class IdentityForm(DescribedModel):
    """The phone's frame is the object's."""

    model_config = with_example(method="identity", name="the phone itself")

    method: Which[Literal["identity"]]
    name: Name
    """What to call the mount."""


@by_id(DrawingWay, leave_out=_LEFT_OUT)
class DrawingForm(DescribedModel):
    """A holder's drawing says where the phone is; one of axes, euler and quaternion."""

    model_config = with_example(
        method="drawing",
        name="printed holder",
        phone="iPhone 15",
        xyz=[0, 0.12, 0.31],
        axes="screen faces +y, top edge points +z",
    )

    method: Which[Literal["drawing"]]
    name: Name
    """What to call the mount."""
    object: Id | None = None
    """Id of the object, to note which one it is; not noted if not given."""


@by_id(PointsWay, leave_out=_LEFT_OUT)
class PointsForm(DescribedModel):
    """Points measured on the phone and clicked on the object."""

    model_config = with_example(
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

    method: Which[Literal["points"]]
    name: Name
    """What to call the mount."""
    object: Id
    """Id of the object on which the points were clicked."""


MountForm = Annotated[IdentityForm | DrawingForm | PointsForm, Field(discriminator="method")]


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
            residuals = await site.sandbox.run(sandboxed_work.identity, target)
        else:
            residuals = await site.sandbox.run(
                sandboxed_work.by_hand, target, _way(site, id_, given)
            )
        facts: dict[str, Any] = {**await site.sandbox.run(mount_summary, target), **residuals}
        facts["object"] = getattr(given, "object", None)
        info = Info(name=given.name, size=target.stat().st_size, files=1, facts=facts)
        site.library.shelves["mount"].put(id_, info, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return item(id_, info)


class MountLooked(DescribedModel):
    """What a mount implies that is still being typed or clicked."""

    good: str
    """What there is, and how it fits, in a line."""
    doubts: list[str]
    """What speaks against it, and what to look at, in sentences."""
    notes: list[str]
    """What else it implies, in sentences."""
    scene: str
    """The phone on the object as a scene pack (docs/replay.md) in base64; "" while it is not determined."""


@router.post("/look")
async def look_at_mount(
    site: Here, given: Annotated[DrawingForm | PointsForm, Body(discriminator="method")]
) -> MountLooked:
    """Look at a mount before it is made; of points two are enough. Nothing is kept."""
    looked = await site.sandbox.run(sandboxed_work.look_at_mount, _way(site, new_id(), given))
    return MountLooked.model_validate(all_in_page_words(looked, "calibrate"))


def _way(site: Site, id_: str, given: MountForm) -> HandWay:
    """Return what a form says, with the path of the object in place of its id."""
    way = PointsWay if isinstance(given, PointsForm) else DrawingWay
    said = with_paths(site.library, id_, given, way)
    if (object_ := said.pop("object", None)) is not None:
        mesh_file = mesh_file_of(site.library, object_)
        said |= {"object": mesh_file.path, "mesh_scale": mesh_file.scale}
    return way.model_validate(said)


guide_router = APIRouter(prefix="/api/calibration", tags=["calibration"])
_PDF = binary("The sheet as PDF, to be saved.", DOWNLOAD)


class Looked(DescribedModel):
    """What a look at a recording showed."""

    good: str
    """What the recording shows, in a sentence."""
    doubts: list[str]
    """What may spoil the calibration, and what to do about it, in sentences."""
    notes: list[str]
    """What else was seen, in sentences."""


@guide_router.get("")
def ways() -> dict[str, Any]:
    """What each way needs and what to do for it, step by step; and the boards there are to print."""
    from capture_app.web.calibration_forms import FORMS, calibration_form

    return {
        "ways": {key: calibration_form(key) for key in FORMS},
        "papers": list(PAPERS),
        "boards": {
            name: {
                "text": str(board),
                "width_mm": round(1e3 * board.width, 3),
                "height_mm": round(1e3 * board.height, 3),
            }
            for name, board in PRESETS.items()
        },
    }


@guide_router.get("/look")
async def look(
    site: Here,
    of: Annotated[sandboxed_work.Look, Query(description="What it is to be used for.")],
    id: Annotated[Id, Query(description="Id of a session, a video or a material.")],
    board: Annotated[
        ShortText, Query(description="The board that it shows, as its sheet says.")
    ] = "",
) -> Looked:
    """A quick look at a recording, a film or a log, by what it is to be used for."""
    path = site.library.content(id, "session", "video", "material")
    looked = await site.sandbox.run(sandboxed_work.look, path, of, board)
    return Looked.model_validate(all_in_page_words(looked, "calibrate"))


@guide_router.get("/board.pdf", response_class=FileResponse, responses=_PDF)
async def board_sheet(
    site: Here,
    paper: Annotated[
        str,
        Query(
            max_length=40, description="The sheet's size: a name that GET /api/calibration lists."
        ),
    ] = "A4",
) -> FileResponse:
    """The board to print at 100 %."""
    path = site.library.cache / f"board-{cache_key('board', paper)}.pdf"
    if not path.is_file():
        await site.sandbox.run(sandboxed_work.board_sheet, paper, path)
    return file_response(path, "board.pdf")
