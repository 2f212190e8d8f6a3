"""What a user may choose of a scan, and how finely a draft looks at a film.

It imports nothing large, so that the command line starts at once.
"""

from dataclasses import dataclass
from typing import Literal

Measured = Literal["auto", "stereo", "depth", "both"]
"""The surface is measured by matching pictures (stereo), by LiDAR (depth), by both, or by all there is."""
Method = Literal["auto", "stereo", "depth", "both", "mesh"]
"""It is measured, or cut out of the room's mesh that an app made (mesh)."""
Symmetry = Literal["auto", "on", "off"]
"""Whether one half of a symmetric object may show what the other hides; auto: where no picture does."""
Unit = Literal["m", "cm", "mm", "in", "ft"]
"""Unit of a mesh that another app made."""
Up = Literal["y", "z"]
"""The axis of a mesh file that is up."""
PICTURES = 80
"""Pictures of a film to use."""
DRAFT_PICTURES = 24
"""Most pictures of a film that a draft uses."""
VERTICES = 10_000
"""Number of vertices of the mesh, about."""


@dataclass(frozen=True)
class Detail:
    """How finely a film is looked at, after its cameras were found."""

    matched: int = 480
    """Width of the pictures that are matched, pixels."""
    outlined: int = 640
    """Width of the pictures in which outlines are found, pixels."""
    voxel: float | None = None
    """Metres between the places that are measured; None: as fine as the memory allows."""


WHOLE, DRAFT = Detail(), Detail(matched=320, outlined=480, voxel=0.007)
