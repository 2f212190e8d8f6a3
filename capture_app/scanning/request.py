"""Everything a user says when they ask for the mesh of an object."""

from dataclasses import dataclass, field
from pathlib import Path

from ingest.report.scanned import work_folder
from ingest.scan.cameras.options import CameraOptions
from ingest.scan.clean.clean import VERTICES
from ingest.scan.dense.depths import Method
from ingest.scan.frames import COUNT
from ingest.scan.region.region import GivenBox
from ingest.scan.sources.units import Unit


@dataclass(frozen=True)
class ScanRequest:
    """One object to be turned into a mesh."""

    source: Path
    """Session, photos, video, COLMAP model, or a mesh that another app made."""
    output: Path
    """The mesh to write."""
    images: Path | None = None
    """Folder of the pictures of a COLMAP model, where they are not beside it."""
    frames: int = COUNT
    """Pictures to pick."""
    cameras: CameraOptions = field(default_factory=CameraOptions)
    """How to find the cameras, and what gives the scale; its height also scales a ready mesh."""
    box: GivenBox | None = None
    """Where the object is, if it is not to be found."""
    method: Method = "auto"
    vertices: int = VERTICES
    """Of the mesh, about."""
    unit: Unit | None = None
    """Of a ready mesh."""
    object_name: str | None = None
    """Of the object in a ready mesh that holds several."""
    format: str | None = None
    """Name of the app whose session it is, as `omocap formats` lists it; found out if None."""
    keep: bool = True
    """Keep what is slow to make, so that the same scan with other options takes seconds."""
    replace: bool = False
    """Put the mesh in place of an earlier one."""

    @property
    def work(self) -> Path:
        """The folder beside the mesh: report, pictures, COLMAP model, and kept stages."""
        return work_folder(self.output)
