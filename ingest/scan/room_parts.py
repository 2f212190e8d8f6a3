"""Parts of a room's mesh: the floor, what stands on it, and which one is meant."""

from dataclasses import dataclass, replace
from pathlib import Path

import igl
import numpy as np
import trimesh
from jaxtyping import Bool, Float64, Int64
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ingest.axes import T_ZUP_ARKIT
from ingest.mesh_files.file_parts import FilePart
from ingest.mesh_texture import BaseColour
from ingest.report.take_report import Check
from ingest.scan.mesh_sources import METRES, STATES_UP, read_parts
from ingest.scan.region import floor_frame
from ingest.scan.scan_choices import Unit, Up
from omomo_core.errors import InputError

LEVEL = np.radians(15)
"""Between up and the normal of a level triangle."""
_BIN = 0.02
"""Metres of height that are counted together."""
_LOWEST = 0.2
"""A floor has so much of the level surface that the most of any height is."""
_NEAR = 3.0
"""Metres around the object: the floor may slope elsewhere."""
_THICK = 0.05
"""Metres from the floor of what is fitted."""
_ROUNDS = 5
_ROOM = 6.0
"""Metres that the largest side of a mesh of unknown unit is taken for."""
_WIDE, _RISES = 0.3, 0.05
"""Part of its footprint that is floor, and height above it in parts of the footprint's side, of a room."""
_BELOW = 0.02
"""Part of all surface that may lie below a floor, by mistakes of the scan."""
_TILT = np.radians(6)


def level_area(corners: Float64[np.ndarray, "faces 3 3"]) -> float:
    """Square metres at the height that a floor would have; 0 where nothing is level."""
    areas, height = _level(corners)[1:]
    at = _lowest_peak(areas, height)
    return 0.0 if at is None else float(areas[np.abs(height - at) < _THICK].sum())


def has_floor(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"]
) -> bool:
    """Whether a mesh of any unit, z up, shows a floor with things on it, which no object has.

    A floor looks up, is a good part of all that there is seen from above, ends in an open rim, has
    nothing below, and things rise above it.
    """
    scaled = vertices * (_ROOM / max(float(np.ptp(vertices, axis=0).max()), 1e-9))
    corners = scaled[faces]
    areas, height = _level(corners)[1:]
    at = _lowest_peak(areas, height)
    if at is None:
        return False
    footprint = float(np.ptp(scaled[:, 0]) * np.ptp(scaled[:, 1]))
    wide = areas[np.abs(height - at) < _THICK].sum() > _WIDE * footprint
    rises = scaled[:, 2].max() - at > _RISES * np.sqrt(footprint)
    ends = scaled[np.asarray(igl.boundary_facets(faces)[0]).reshape(-1, 2)]
    low = (np.abs(ends[..., 2] - at) < _THICK).all(axis=1)
    rim = np.linalg.norm(ends[low, 0] - ends[low, 1], axis=1).sum()
    area = trimesh.triangles.area(corners)
    below = area[corners[..., 2].max(axis=1) < at - _THICK].sum() > _BELOW * area.sum()
    return bool(wide and rises and rim > np.sqrt(footprint) and not below)


def find_room_floor(
    corners: Float64[np.ndarray, "faces 3 3"], near: Float64[np.ndarray, "3"] | None, where: str
) -> Float64[np.ndarray, "4 4"]:
    """The lowest wide level surface, tilted as its triangles are: T_world_floor, whose z is its normal.

    Args:
        corners: of the room's triangles, z up, metres.
        near: a point over it; the floor is that around it.
        where: the room came from, for messages.

    Raises:
        InputError: "scan-no-floor".
    """
    level, areas, height = _level(corners)
    middles = corners[level].mean(axis=1)
    if near is not None:
        close = np.linalg.norm((middles - near)[:, :2], axis=1) < _NEAR
        middles, areas, height = middles[close], areas[close], height[close]
    at = _lowest_peak(areas, height)
    if at is None:
        raise InputError(
            "scan-no-floor",
            "Nothing in the mesh is level, as a floor is.",
            where=where,
            fix="Say which axis of the file is up (‹up›), or export the room with its floor.",
        )
    normal, offset = np.array([0.0, 0.0, 1.0]), at
    for _ in range(_ROUNDS):
        on = np.abs(middles @ normal - offset) < _THICK
        slope = _plane(middles[on], areas[on])
        if slope[2] < np.cos(_TILT):
            break
        normal, offset = slope, float(np.average(middles[on] @ slope, weights=areas[on]))
    point = np.average(middles, axis=0, weights=areas) if near is None else near
    return floor_frame(normal, offset, point)


def _level(
    corners: Float64[np.ndarray, "faces 3 3"],
) -> tuple[
    Bool[np.ndarray, " faces"], Float64[np.ndarray, " level"], Float64[np.ndarray, " level"]
]:
    """Which triangles look up, their areas, and their heights."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    level = normal[:, 2] > np.cos(LEVEL) * np.maximum(length, 1e-12)
    return level, length[level] / 2, corners[level].mean(axis=1)[:, 2]


def _lowest_peak(
    areas: Float64[np.ndarray, " level"], height: Float64[np.ndarray, " level"]
) -> float | None:
    """The height of the lowest level surface that is wide."""
    if len(areas) == 0:
        return None
    number = np.floor((height - height.min()) / _BIN).astype(np.int64)
    wide = np.convolve(np.bincount(number, areas), np.ones(3), mode="same")
    first = int(np.flatnonzero(wide >= _LOWEST * wide.max())[0])
    # From the first height that has enough, up to where there is the most of the same surface.
    while first + 1 < len(wide) and wide[first + 1] > wide[first]:
        first += 1
    return float(height.min() + (first + 0.5) * _BIN)


def _plane(
    points: Float64[np.ndarray, "points 3"], weights: Float64[np.ndarray, " points"]
) -> Float64[np.ndarray, "3"]:
    """The unit normal, upwards, of the plane through points."""
    off = points - np.average(points, axis=0, weights=weights)
    normal = np.linalg.eigh((off * weights[:, None]).T @ off)[1][:, 0]
    return normal * np.sign(normal[2] or 1.0)


CUTS = (0.015, 0.02, 0.03, 0.04, 0.05, 0.065, 0.08, 0.1, 0.12)
"""Metres above the floor at which a thing may be cut off it, the lowest that does it is taken."""
REACH = 0.3
"""Metres from a point to what it is meant to lie on, at most."""
LARGEST = 2.5
"""Metres of the largest side of what people carry, drag or sweep with."""
_BAND, _LEVEL = 0.03, np.radians(30)
"""Metres above a cut in which level triangles are the floor's."""
_FLOOR = 0.01
"""Part of a piece's area that may be such floor."""
_GAP, _FLOATING_GAP = 0.05, 0.25
"""Metres to a piece that belongs to the object though it is apart, and to one that touches no floor."""
_SMALL = 0.3
"""Most area of such a piece, in parts of the object's."""
_PIECE_RISES = 0.1
"""Metres above the cut: to there no bump of the floor rises, and what begins higher floats."""
_THING_HEIGHT, _THING_AREA = 0.12, 0.03
"""Metres, and square metres, of what may be meant where nobody says."""
_LISTED = 6


@dataclass(frozen=True)
class RoomSurface:
    """Triangles of which those that meet share their vertices, in the frame of the floor."""

    vertices: Float64[np.ndarray, "verts 3"]
    faces: Int64[np.ndarray, "faces 3"]

    @property
    def areas(self) -> Float64[np.ndarray, " faces"]:
        """Square metres."""
        return np.linalg.norm(self._crosses, axis=1) / 2

    @property
    def level(self) -> Bool[np.ndarray, " faces"]:
        """Which triangles look up, about."""
        cross = self._crosses
        return cross[:, 2] > np.cos(_LEVEL) * np.maximum(np.linalg.norm(cross, axis=1), 1e-12)

    @property
    def _crosses(self) -> Float64[np.ndarray, "faces 3"]:
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return np.cross(b - a, c - a)


def pieces_above(surface: RoomSurface, height: float) -> Int64[np.ndarray, " faces"]:
    """The number of the piece of each triangle that reaches above a height, -1 of the others.

    Triangles are of one piece where they share a vertex above it.
    """
    above = surface.vertices[:, 2] > height
    faces = surface.faces
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges = edges[above[edges].all(axis=1)]
    count = len(surface.vertices)
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    number = connected_components(graph, directed=False)[1].astype(np.int64)
    reaches = above[faces]
    first = faces[np.arange(len(faces)), reaches.argmax(axis=1)]
    return np.where(reaches.any(axis=1), number[first], -1)


def object_at(
    surface: RoomSurface, at: Float64[np.ndarray, "3"], where: str
) -> tuple[Bool[np.ndarray, " faces"], float]:
    """The triangles of what stands at a point, and the height at which it is cut off the floor.

    Raises:
        InputError: "scan-nothing-there" where nothing is near the point, "scan-joined" where what is
            there goes over into the floor, a wall or other things.
    """
    areas, level = surface.areas, surface.level
    top = surface.vertices[surface.faces, 2].max(axis=1)
    sides = np.zeros(3)
    for height in CUTS:
        number = pieces_above(surface, height)
        mine = number == _nearest(surface, number, at, where)
        floor = mine & level & (top < height + _BAND)
        sides = _extents(surface, mine)
        if areas[floor].sum() <= _FLOOR * areas[mine].sum() and sides.max() <= LARGEST:
            return mine | _hanging(surface, number, mine, height), height
    size = " x ".join(f"{side:.2f}" for side in sides)
    raise InputError(
        "scan-joined",
        f"What stands at that point is joined to other things or to the floor: {size} m in all.",
        where=where,
        fix="Give a box around the object that is free of all else (‹box›).",
    )


def _nearest(
    surface: RoomSurface,
    number: Int64[np.ndarray, " faces"],
    at: Float64[np.ndarray, "3"],
    where: str,
) -> int:
    """The piece whose surface is nearest to a point."""
    faces = np.flatnonzero(number >= 0)
    squared, found = np.inf, 0
    if len(faces):
        triangles = np.ascontiguousarray(surface.faces[faces])
        squares, face, _ = igl.point_mesh_squared_distance(at[None], surface.vertices, triangles)
        squared, found = float(np.ravel(squares)[0]), int(faces[int(np.ravel(face)[0])])
    if squared > REACH**2:
        raise InputError(
            "scan-nothing-there",
            f"Nothing stands within {100 * REACH:.0f} cm of that point.",
            where=where,
            fix="Give a point on the object's surface (‹at›), x,y,z in metres, z up.",
        )
    return int(number[found])


def _extents(surface: RoomSurface, chosen: Bool[np.ndarray, " faces"]) -> Float64[np.ndarray, "3"]:
    return np.ptp(surface.vertices[np.unique(surface.faces[chosen])], axis=0)


def _hanging(
    surface: RoomSurface,
    number: Int64[np.ndarray, " faces"],
    mine: Bool[np.ndarray, " faces"],
    height: float,
) -> Bool[np.ndarray, " faces"]:
    """Small pieces beside the object: thin parts that join them to it are missing in an app's mesh."""
    near = KDTree(surface.vertices[np.unique(surface.faces[mine])])
    most = _SMALL * surface.areas[mine].sum()
    others = (number >= 0) & ~mine
    areas = np.bincount(number[others], surface.areas[others], minlength=1)
    joined = np.zeros_like(mine)
    for piece in np.flatnonzero((areas > 0) & (areas < most)):
        its = others & (number == piece)
        corners = surface.vertices[np.unique(surface.faces[its])]
        low, high = corners[:, 2].min() - height, corners[:, 2].max() - height
        gap = _FLOATING_GAP if low > _PIECE_RISES else _GAP
        if high > _PIECE_RISES and near.query(corners, distance_upper_bound=gap)[0].min() < gap:
            joined |= its
    return joined


def only_thing(
    surface: RoomSurface, T_world_floor: Float64[np.ndarray, "4 4"], where: str
) -> Float64[np.ndarray, "3"]:
    """A point on the one thing that stands on the floor.

    Raises:
        InputError: "scan-no-object" where there is none, "scan-several" where there are several.
    """
    number = pieces_above(surface, CUTS[len(CUTS) // 2])
    areas = np.bincount(number[number >= 0], surface.areas[number >= 0], minlength=1)
    things: list[Float64[np.ndarray, "verts 3"]] = []
    for piece in np.argsort(-areas, kind="stable"):
        if areas[piece] < _THING_AREA:
            break
        corners = surface.vertices[np.unique(surface.faces[number == piece])]
        if corners[:, 2].max() > _THING_HEIGHT and np.ptp(corners, axis=0).max() <= LARGEST:
            things.append(corners)
    if not things:
        raise InputError(
            "scan-no-object",
            "Nothing that a person could move stands on the floor of this mesh.",
            where=where,
            fix="Say where it is (‹at› or ‹box›), or which axis of the file is up (‹up›).",
        )
    if len(things) > 1:
        raise _several([_described(corners, T_world_floor) for corners in things], where)
    return _top(things[0])


def _top(corners: Float64[np.ndarray, "verts 3"]) -> Float64[np.ndarray, "3"]:
    return corners[corners[:, 2].argmax()]


def _described(
    corners: Float64[np.ndarray, "verts 3"], T_world_floor: Float64[np.ndarray, "4 4"]
) -> str:
    size = " x ".join(f"{side:.2f}" for side in np.ptp(corners, axis=0))
    at = T_world_floor[:3, :3] @ _top(corners) + T_world_floor[:3, 3]
    return f"{size} m at {','.join(f'{x:.2f}' for x in at)}"


def _several(things: list[str], where: str) -> InputError:
    more = f", and {len(things) - _LISTED} more" if len(things) > _LISTED else ""
    return InputError(
        "scan-several",
        f"{len(things)} things stand on the floor: {'; '.join(things[:_LISTED])}{more}.",
        where=where,
        fix="Say which one is meant by a point on it (‹at›), x,y,z in metres, z up.",
    )


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
    fix = "If the mesh lies on its side, say which axis is up (‹up›)."
    return (turned if up == "y" else corners), Check("up", severity, message, None, fix)
