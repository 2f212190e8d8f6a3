"""What a report, a scene or a job reads: ids of the library turned into paths."""

from dataclasses import dataclass
from pathlib import Path

from capture_app.web.library.library import Library
from capture_app.web.library.shelf import FILES


@dataclass(frozen=True)
class Solid:
    """An object's mesh."""

    path: Path
    scale: float
    """Factor that brings it to metres."""


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
