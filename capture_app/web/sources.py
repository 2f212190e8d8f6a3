"""What a report, a scene or a job reads: ids of the library turned into paths."""

from pathlib import Path
from typing import Any, Literal

from pydantic import Field, create_model
from pydantic.fields import FieldInfo

from capture_app.commands.inputs import DescribedModel, MeshFile, typed_as
from capture_app.commands.reading import ReadingOptions
from capture_app.library_item import FILES
from capture_app.scanning.scan_folder import MODEL
from capture_app.web.library import Library
from capture_app.web.problems import Refused
from capture_app.web.sandboxed_work import SessionInputs
from capture_app.web.shelves import Id
from ingest.report.take_inspection import work_folder
from ingest.trajectory.trajectory_config import Reading

IDENTITY = "identity"
"""In place of a mount's id: the mesh is in the phone's own frame."""
MountChoice = Id | Literal["identity"]


class _SeenWith(DescribedModel):
    object: Id | None = None
    """Id of the object; without it only the log is judged, if not given."""
    mount: MountChoice | None = None
    """Id of the mount, or "identity"; where the phone was is not judged if not given."""


def _in_query(field: FieldInfo) -> Any:
    """A field as the query of an address has it: what is not plain is text."""
    kind = typed_as(field.annotation)
    if kind == str | None:
        return kind, Field(default=None, max_length=100, description=field.description)
    return field.annotation, field


_READING = {name: _in_query(field) for name, field in ReadingOptions.model_fields.items()}


class ReadAs(create_model("_Reading", __base__=_SeenWith, **_READING)):
    """The query of a report or a scene: what its reader would tell a run."""

    @property
    def reading(self) -> Reading:
        """The same, as the readers take it.

        Raises:
            InputError: "direction-invalid".
        """
        return ReadingOptions(**self.model_dump(exclude={"object", "mount"})).reading


def mesh_file_of(library: Library, id_: str) -> MeshFile:
    """The mesh of an object.

    Raises:
        Refused: 404 when it is not there.
    """
    shelf = library.shelves["object"]
    facts = shelf.get(id_).facts
    return MeshFile(shelf.folder / id_ / FILES / facts["mesh"], float(facts["scale"]))


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
    mesh_file = None if said.object is None else mesh_file_of(library, said.object)
    mount = mount_of(library, said.mount)
    return SessionInputs(
        session=library.shelves["session"].content(session),
        mesh=mesh_file.path if mesh_file else None,
        mount=mount if mesh_file else None,
        mounted=said.mount is not None,
        scale=mesh_file.scale if mesh_file else 1.0,
        reading=said.reading,
    )


def scan_of(library: Library, id_: str) -> Path:
    """The folder with the model and the pictures of the scan that an object was made by.

    Raises:
        Refused: 404 when there is no such object, or none that was scanned here.
    """
    mesh = mesh_file_of(library, id_).path
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
