"""What a report, a scene or a job reads: ids of the library turned into paths."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from capture_app.coordinates import read_up
from capture_app.scanning.folder import MODEL
from capture_app.solid import Solid
from capture_app.things import FILES
from capture_app.web.library.ids import Id
from capture_app.web.library.library import Library
from capture_app.web.limited.work import SessionInputs
from capture_app.web.problems import Refused
from ingest.report.scanned import work_folder
from ingest.trajectory.reading import Reading

IDENTITY = "identity"
"""In place of a mount's id: the mesh is in the phone's own frame."""
MountChoice = Id | Literal["identity"]


class ReadAs(BaseModel):
    """In the query of a report or a scene: what its reader would tell a run."""

    object: Id | None = None
    mount: MountChoice | None = None
    floor: Annotated[float, Field(allow_inf_nan=False)] | None = None
    """Height above the session's origin along up, metres; negative below where it started."""
    up: Annotated[str, Field(max_length=100)] | None = None
    """A direction in the phone's world, "0,1,0", or the axis of the mesh that is up, "object:z"."""
    segment: Annotated[int, Field(ge=1, lt=2**31)] | None = None
    format: Annotated[str, Field(max_length=100)] | None = None
    stitch: bool = False
    closure: bool = False

    @property
    def reading(self) -> Reading:
        """The same, as the readers take it.

        Raises:
            InputError: "direction-invalid".
        """
        up = read_up(self.up, "up")
        return Reading(self.floor, up, self.stitch, self.closure, self.segment, self.format)


def solid_of(library: Library, id_: str) -> Solid:
    """The mesh of an object.

    Raises:
        Refused: 404 when it is not there.
    """
    shelf = library.shelves["object"]
    facts = shelf.get(id_).facts
    return Solid(shelf.folder / id_ / FILES / facts["mesh"], float(facts["scale"]))


def mount_of(library: Library, chosen: MountChoice | None) -> Path | None:
    """The file of a mount; None where there is none: the phone's frame is the object's.

    Raises:
        Refused: 404 when it is not there.
    """
    if chosen is None or chosen == IDENTITY:
        return None
    return library.shelves["mount"].content(chosen)


def seen_with(library: Library, session: str, said: ReadAs) -> SessionInputs:
    """A session with what is said of it, ids of the library turned into paths.

    Raises:
        Refused: 404 when one of the things is not there.
        InputError: "direction-invalid".
    """
    solid = None if said.object is None else solid_of(library, said.object)
    mount = mount_of(library, said.mount)
    return SessionInputs(
        session=library.shelves["session"].content(session),
        mesh=solid.path if solid else None,
        mount=mount if solid else None,
        mounted=said.mount is not None,
        scale=solid.scale if solid else 1.0,
        reading=said.reading,
    )


def scan_of(library: Library, id_: str) -> Path:
    """The folder with the model and the pictures of the scan that an object was made by.

    Raises:
        Refused: 404 when there is no such object, or none that was scanned here.
    """
    mesh = solid_of(library, id_).path
    folder = work_folder(mesh)
    if not (folder / MODEL).is_dir():
        raise Refused(
            404,
            "scan-missing",
            "This object was not scanned here: there are no pictures of it to be found again.",
            where=id_,
            fix="Make the object from a film of it first, or bring the COLMAP model of its scan.",
        )
    return folder
