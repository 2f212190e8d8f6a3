"""Pieces of a room's mesh that stand apart above its floor, and which of them is meant."""

from dataclasses import dataclass

import igl
import numpy as np
from jaxtyping import Bool, Float64, Int64
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from omomo_core.errors import InputError

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
_RISES = 0.1
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
        fix="Give a box around the object that is free of all else (--box).",
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
            fix="Give a point on the object's surface (--at), x,y,z in metres, z up.",
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
        gap = _FLOATING_GAP if low > _RISES else _GAP
        if high > _RISES and near.query(corners, distance_upper_bound=gap)[0].min() < gap:
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
            fix="Say where it is (--at or --box), or which axis of the file is up (--up).",
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
        fix="Say which one is meant by a point on it (--at), x,y,z in metres, z up.",
    )
