"""Way: what all ways to calibrate a mount have, and the fields that several of them share."""

from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field

from capture_app.commands.inputs import FromLibrary, LogFormat, ShortText
from capture_app.mesh_file import MeshFile

_MESH = "Mesh of the object: OBJ, PLY, STL or GLB, in metres; its frame is the one calibrated."
_MAYBE_MESH = "Mesh of the object, to note which one it is."
Object = Annotated[Path, Field(description=_MESH)]
MaybeObject = Annotated[Path | None, Field(description=_MAYBE_MESH)]
SessionPath = Annotated[Path, FromLibrary(("session",))]


class Way(BaseModel):
    """What all ways have."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    READS: ClassVar[tuple[str, ...]] = ()
    """Fields that are paths of inputs, beside `object`, the mesh, which each way has."""

    mesh_scale: Annotated[float, Field(gt=0)] = 1.0
    """Factor that brings the mesh to metres."""
    phone: Annotated[
        ShortText, Field(title="Phone", description='Model of the phone, such as "iPhone 15".')
    ] = ""
    format: LogFormat = None

    @property
    def mesh_file(self) -> MeshFile | None:
        """The object's mesh, when it is given."""
        mesh = self.inputs.get("object")
        return None if mesh is None else MeshFile(mesh, self.mesh_scale)

    @property
    def inputs(self) -> dict[str, Path]:
        """The inputs that are given, by role."""
        roles = ("object", *self.READS)
        given: dict[str, Path | None] = {role: getattr(self, role) for role in roles}
        return {role: path for role, path in given.items() if path is not None}

    @property
    def options(self) -> dict[str, Any]:
        """What else is said, as JSON has it."""
        return self.model_dump(mode="json", exclude={"object", *self.READS})
