"""What a user may choose of a scan; it imports nothing, so that the command line starts at once."""

from typing import Literal

Measured = Literal["auto", "stereo", "depth", "both"]
"""The surface is measured by matching pictures (stereo), by LiDAR (depth), by both, or by all there is."""
Method = Literal["auto", "stereo", "depth", "both", "mesh"]
"""It is measured, or cut out of the room's mesh that an app made (mesh)."""
Symmetry = Literal["auto", "on", "off"]
"""Whether one half of a symmetric object may show what the other hides; auto: where no picture does."""
Unit = Literal["m", "cm", "mm", "in", "ft"]
"""Of a mesh that another app made."""
Up = Literal["y", "z"]
"""The axis of a mesh file that is up."""
PICTURES = 80
"""Pictures of a film to use."""
DRAFT_PICTURES = 24
"""Most pictures of a film that a draft uses."""
DRAFT_VOXEL = 0.009
"""Voxel of a draft, metres."""
VERTICES = 10_000
"""Of the mesh, about."""
