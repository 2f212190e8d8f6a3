"""What a report, a scene or a job reads: ids of the library turned into paths."""

from dataclasses import dataclass
from pathlib import Path

from capture_app.scanning.folder import MODEL
from capture_app.solid import Solid
from capture_app.things import FILES
from capture_app.web.library.library import Library
from capture_app.web.problems import Refused


def solid_of(library: Library, id_: str) -> Solid:
    """The mesh of an object.

    Raises:
        Refused: 404 when it is not there.
    """
    shelf = library.shelves["object"]
    facts = shelf.get(id_).facts
    return Solid(shelf.folder / id_ / FILES / facts["mesh"], float(facts["scale"]))


@dataclass(frozen=True)
class Seen:
    """A session, with the object and the mount that it is looked at with."""

    session: Path
    mesh: Path | None
    mount: Path | None
    scale: float


def seen_with(library: Library, session: str, object_: str | None, mount: str | None) -> Seen:
    """The files of a session and, where they are given, of an object and a mount.

    Raises:
        Refused: 404 when one of them is not there.
    """
    solid = None if object_ is None else solid_of(library, object_)
    return Seen(
        session=library.shelves["session"].content(session),
        mesh=solid.path if solid else None,
        mount=None if mount is None or solid is None else library.shelves["mount"].content(mount),
        scale=solid.scale if solid else 1.0,
    )


def scan_of(library: Library, id_: str) -> Path:
    """The folder with the model and the pictures of the scan that an object was made by.

    Raises:
        Refused: 404 when there is no such object, or none that was scanned here.
    """
    mesh = solid_of(library, id_).path
    folder = mesh.with_suffix(".scan")
    if not (folder / MODEL).is_dir():
        raise Refused(
            404,
            "scan-missing",
            "This object was not scanned here: there are no pictures of it to be found again.",
            where=id_,
            fix="Make the object from a film of it first, or bring the COLMAP model of its scan.",
        )
    return folder
