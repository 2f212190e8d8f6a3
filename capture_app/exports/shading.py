"""Normals of the object's surface: smooth, with hard edges where faces meet at an angle."""

from dataclasses import replace

import numpy as np

from capture_app.exports.own_bones import unit_normals
from omomo_core.geometry.surface import SplitSurface, split_creases
from omomo_core.motion import ObjectMesh

_CREASE = np.radians(30.0)
"""Neighbouring faces that meet at a sharper angle than this keep a hard edge."""


def creased(mesh: ObjectMesh) -> SplitSurface:
    """The surface with its vertices doubled along hard edges and seams, and unit normals."""
    uv = None if mesh.texture is None else mesh.texture.uv
    split = split_creases(mesh.vertices, mesh.faces, _CREASE, uv)
    return replace(split, normals=unit_normals(split.normals))
