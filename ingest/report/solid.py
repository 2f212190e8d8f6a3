"""Whether the mesh can be the thing that was moved."""

import numpy as np

from ingest.report.check import Check, graded
from omomo_core.motion import ObjectMesh

_TINY, _SMALL, _LARGE, _HUGE = 0.06, 0.1, 2.5, 3.5
"""Metres, of the largest side: a phone is 0.15 long; a ladder 3; more is not carried about."""
_MANY_TRIANGLES = 200_000


def mesh_checks(mesh: ObjectMesh) -> list[Check]:
    """The mesh's size and its number of triangles."""
    sides = np.ptp(mesh.vertices, axis=0)
    largest = float(sides.max())
    message = " x ".join(f"{side:.2f}" for side in sides) + f" m, {len(mesh.faces):,} triangles"
    severity = (
        "bad" if not _TINY <= largest <= _HUGE else "ok" if _SMALL < largest < _LARGE else "warn"
    )
    fix = "Give the mesh in metres, or the factor to metres with --mesh-scale."
    if severity == "ok" and len(mesh.faces) > _MANY_TRIANGLES:
        severity, fix = "warn", "Simplify the mesh: 20,000 triangles are plenty for a motion."
    return [graded("mesh", severity, message, fix)]
