"""Things of a library on the disk, each a folder, and what a list tells of them."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, Field, StringConstraints, ValidationError

from omomo_core.whole_file import write_whole

INFO, FILES, PICTURE = "info.json", "files", "picture.webp"
"""Names in the folder of a thing; its picture may be missing."""

Name = Annotated[
    str,
    StringConstraints(strip_whitespace=True, min_length=1, max_length=200, pattern=r"^[^\x00]*$"),
]
"""What a person calls a thing; it is shown, and never becomes part of a path."""


def now() -> datetime:
    """Return the time to the second, UTC."""
    return datetime.now(UTC).replace(microsecond=0)


class Info(BaseModel):
    """What stands in info.json."""

    name: str
    created: datetime = Field(default_factory=now)
    size: int = 0
    """Bytes of all its files."""
    files: int = 0
    facts: dict[str, Any] = {}
    """What a list shows of things of this kind."""


def save_info(path: Path, info: BaseModel) -> None:
    """Write a record as a file that appears whole."""
    write_whole(path, info.model_dump_json(indent=1) + "\n")


def load_info(path: Path) -> Info | None:
    """Read it; None where there is none, or none that makes sense."""
    try:
        return Info.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        return None


def info_of(name: str, folder: Path, facts: dict[str, Any]) -> Info:
    """The record of a thing whose files are in this folder."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    size = sum(path.stat().st_size for path in files)
    return Info(name=name, size=size, files=len(files), facts=facts)


def mesh_summary(path: Path, scale: float) -> dict[str, Any]:
    """Return the summary of an object as JSON; `scale` brings its mesh to metres.

    Raises:
        InputError: as `load_mesh`.
    """
    from ingest.mesh import load_mesh
    from ingest.report.take_inspection import mesh_checks

    mesh = load_mesh(path, scale=scale)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return {
        "scale": scale,
        "vertices": len(mesh.vertices),
        "faces": len(mesh.faces),
        "extents": np.round(high - low, 6).tolist(),
        "warnings": [c.message for c in mesh_checks(mesh) if c.severity != "ok"],
    }


def mount_summary(path: Path) -> dict[str, Any]:
    """Return the summary of a mount as JSON.

    Raises:
        InputError: as `load_mount`.
    """
    from ingest.mount_file import load_mount
    from ingest.uncertainty import bounds_95

    mount = load_mount(path)
    bounds = None if mount.covariance is None else bounds_95(mount.covariance)._asdict()
    return {
        "method": mount.method,
        "bounds": bounds,
        "residuals": {k: v for k, v in mount.residuals.items() if np.isfinite(v)},
        "free": list(mount.free),
        "note": mount.note,
        "warnings": [*mount.free, *filter(None, [mount.note])],
        "phone": mount.phone,
        "object_id": mount.object_id,
        "date": mount.date,
    }
