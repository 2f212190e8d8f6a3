"""What a list tells of an object and of a mount."""

from pathlib import Path
from typing import Any

import numpy as np

from ingest.mesh import load_mesh
from ingest.mount_file import load_mount
from ingest.report.inspect import mesh_checks
from ingest.uncertainty import bounds_95


def mesh_summary(path: Path, scale: float) -> dict[str, Any]:
    """Of an object, as JSON; `scale` brings its mesh to metres.

    Raises:
        InputError: as `load_mesh`.
    """
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
    """Of a mount, as JSON.

    Raises:
        InputError: as `load_mount`.
    """
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
