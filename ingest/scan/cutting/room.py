"""read_room: the mesh of a room as an app exported it, z up, with its pictures still packed."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float64, Int64

from ingest.axes import T_ZUP_ARKIT
from ingest.mesh_texture import BaseColour
from ingest.report.check import Check
from ingest.scan.choices import Unit, Up
from ingest.scan.cutting.floor import level_area
from ingest.scan.sources.mesh import METRES
from ingest.scan.sources.mesh_parts import STATES_UP, FilePart, read_parts

NO_PICTURE = -1
_SURE = 1.5
"""Times the level surface along the other axis: with less, either axis may be up."""


@dataclass(frozen=True)
class RoomMesh:
    """Triangles of a room, z up, metres. Corners that meet are apart, because their looks may differ."""

    corners: Float64[np.ndarray, "faces 3 3"]
    looks: Float64[np.ndarray, "faces 3 6"]
    """u, v (as in `Texture`), red, green, blue (0 to 255), and the number of the picture, NO_PICTURE
    where there is none."""
    pictures: tuple[BaseColour, ...]
    coloured: bool
    """Whether the file states colours."""
    where: Path
    notes: tuple[Check, ...] = ()

    @property
    def surface(self) -> trimesh.Trimesh:
        """The triangles alone."""
        number = np.arange(3 * len(self.corners)).reshape(-1, 3)
        return trimesh.Trimesh(self.corners.reshape(-1, 3), number, process=False)

    def only(self, faces: Int64[np.ndarray, " kept"]) -> "RoomMesh":
        """Some of its triangles."""
        return replace(self, corners=self.corners[faces], looks=self.looks[faces])


def read_room(path: Path, *, unit: Unit | None = None, up: Up | None = None) -> RoomMesh:
    """Read all there is in a mesh file as one room.

    Args:
        path: GLB, glTF, OBJ, PLY, STL or USD(Z).
        unit: of the file; otherwise what it says, or metres.
        up: the axis of the file that is up; otherwise what it says, or the one along which there is
            the most level surface at the bottom, as a floor is.

    Raises:
        InputError: those of `read_parts`.
    """
    file = read_parts(path, up)
    parts = list(file.parts.values())
    corners = np.concatenate([part.vertices[part.faces] for part in parts])
    corners = corners * (METRES[unit] if unit else file.metres or 1.0)
    notes: tuple[Check, ...] = ()
    if file.up is None:
        corners, note = _upright(corners)
        notes = (note,)
    shown = {id(part.picture): part.picture for part in parts if part.picture is not None}
    number = {key: k for k, key in enumerate(shown)}
    looks = np.concatenate([_looks(p, number.get(id(p.picture), NO_PICTURE)) for p in parts])
    coloured = any(part.colours is not None for part in parts)
    return RoomMesh(corners, looks, tuple(shown.values()), coloured, path, notes)


def read_room_of_session(path: Path) -> RoomMesh:
    """Read the room's mesh of an ARKit session, whose world is y up.

    Raises:
        InputError: those of `read_parts`.
    """
    return read_room(path, up=None if path.suffix.lower() in STATES_UP else "y")


def _looks(part: FilePart, picture: int) -> Float64[np.ndarray, "faces 3 6"]:
    count = len(part.faces)
    colours = (
        np.full((count, 3, 3), 255.0) if part.colours is None else part.colours[part.faces] * 1.0
    )
    number = np.full((count, 3, 1), float(picture))
    return np.concatenate([part.uv, colours, number], axis=2)


def _upright(
    corners: Float64[np.ndarray, "faces 3 3"],
) -> tuple[Float64[np.ndarray, "faces 3 3"], Check]:
    """The room with its floor below, where the file does not say which way is up."""
    turned = corners @ T_ZUP_ARKIT[:3, :3].T
    by_axis: dict[Up, float] = {"z": level_area(corners), "y": level_area(turned)}
    up: Up = "y" if by_axis["y"] > by_axis["z"] else "z"
    least, most = sorted(by_axis.values())
    message = f"{up} is taken for the file's axis that is up: {most:.1f} square metres are level along it."
    severity = "warn" if most < _SURE * max(least, 1e-9) else "ok"
    fix = "If the mesh lies on its side, say which axis is up (--up)."
    return (turned if up == "y" else corners), Check("up", severity, message, None, fix)
