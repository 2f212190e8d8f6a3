"""A measured surface made into the mesh of an object: whole, small, in a frame of its own."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import igl
import numpy as np
import trimesh
from jaxtyping import Bool, Float64, Int64, UInt8
from PIL import Image
from scipy.spatial import KDTree
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from ingest.axes import T_ZUP_ARKIT
from ingest.mesh_texture import to_linear
from ingest.report.take_report import Check, graded
from ingest.scan.scan_choices import VERTICES
from ingest.scan.scan_types import Region, ScanMesh
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import Texture
from omomo_core.whole_file import whole_file

_SHARE = 0.01
"""Share of the area of the largest piece: smaller ones are crumbs."""
_GAP = 0.03
"""Metres: a thin part may be broken that far from the rest."""


def main_piece(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"]
) -> Bool[np.ndarray, " faces"]:
    """Which faces are the object's: the largest piece, and large ones that nearly touch it.

    A closed piece that is wound inwards is a cavity that nobody sees; it is left out.
    """
    number = np.asarray(igl.facet_components(faces)[1], np.int64)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.bincount(number, np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)
    # Six times the volume; of an open piece it says little, but is seldom below zero.
    content = np.bincount(number, np.einsum("ij,ij->i", a - a.mean(axis=0), np.cross(b, c)))
    kept = [int(area.argmax())]
    for piece in np.argsort(-area)[1:]:
        if area[piece] < _SHARE * area[kept[0]]:
            break
        if content[piece] > 0 and _near(vertices, faces, number, int(piece), kept):
            kept.append(int(piece))
    return np.isin(number, kept)


def _near(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    number: Int64[np.ndarray, " faces"],
    piece: int,
    kept: list[int],
) -> bool:
    mine = vertices[np.unique(faces[number == piece])]
    theirs = vertices[np.unique(faces[np.isin(number, kept)])]
    return bool(KDTree(theirs).query(mine, distance_upper_bound=_GAP)[0].min() < _GAP)


FEWEST_VERTICES, MOST_VERTICES = 500, 100_000
_WALL = 0.01
"""Metres from a side of the region where a surface is cut by it."""
_CUT = 0.01
"""Part of the vertices that may lie there."""
UNSEEN = "unseen"
"""The check of how much of the surface is made up; bad where that is most of it."""
_UNSEEN_WARN, _UNSEEN_BAD = 0.3, 0.5
"""Part of the surface that no picture shows: half of that is usual, undersides and insides."""
_BASE = 0.012
"""Metres over the floor: a surface that lies lower is what the object stands on."""
_WIDEST = 0.25
"""Part of the mesh's largest side that the rim of a hole may be long; larger ones are openings."""

_FOOT = 0.05
"""Part of the height, at least so many metres as follow, that is the foot of an object."""
_LEAST_FOOT = 0.02


@dataclass(frozen=True)
class CleanMesh:
    """An object's mesh, and what is known about it."""

    mesh: ScanMesh
    """In the object's frame: z up, base at 0, centred over its footprint."""
    normals: Float64[np.ndarray, "vertices 3"]
    """Unit, outwards."""
    T_world_object: Float64[np.ndarray, "4 4"]
    """Back to the world of the cameras."""
    seen: Bool[np.ndarray, " vertices"]
    """False where no picture shows the surface and it only closes what was seen."""
    watertight: bool


def clean(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    colours: UInt8[np.ndarray, "verts 3"] | None,
    region: Region,
    name: str,
    *,
    seen: Bool[np.ndarray, " verts"] | None = None,
    most: int = VERTICES,
) -> CleanMesh:
    """Keep what is the object, close its small holes, make it small, and put it at its origin.

    Args:
        vertices, faces, colours: what was measured; world, metres.
        region: where the object was looked for; its floor gives the upright.
        name: of the object.
        seen: which vertices a picture shows; all if not given.
        most: vertices, about.

    Raises:
        InputError: "scan-vertices" for a number that makes no sense, "scan-no-surface".
    """
    _check(most, faces)
    seen = np.ones(len(vertices), np.bool_) if seen is None else seen
    kept, solid = _compact(vertices, faces[main_piece(vertices, faces)])
    vertices, seen = vertices[kept], seen[kept]
    colours = None if colours is None else colours[kept]
    closed, solid, rims = _filled(vertices, solid)
    small, triangles = _decimated(closed, solid, most)
    used, triangles = _compact(small, triangles)
    small = _above_floor(small[used], region)
    colours, seen = _handed_on(vertices, small, colours, seen)
    T = object_frame(small, region.T_world_floor)
    own = (small - T[:3, 3]) @ T[:3, :3]
    watertight = _closed(triangles)
    notes = (_cut(small, region), _shown(own, triangles, seen), _tight(watertight, rims))
    return CleanMesh(
        mesh=ScanMesh(own, triangles, colours, name, notes),
        normals=np.asarray(igl.per_vertex_normals(own, triangles), np.float64),
        T_world_object=T,
        seen=seen,
        watertight=watertight,
    )


def _check(most: int, faces: Int64[np.ndarray, "faces 3"]) -> None:
    if not FEWEST_VERTICES <= most <= MOST_VERTICES:
        raise InputError(
            "scan-vertices",
            f"A mesh of {most:,} vertices was asked for; it can have {FEWEST_VERTICES:,} to "
            f"{MOST_VERTICES:,}.",
            fix=f"{VERTICES:,} are plenty for a motion.",
        )
    if len(faces) == 0:
        raise InputError(
            "scan-no-surface",
            "There is no surface to clean.",
            fix="Film the object closer and all around, in more light.",
        )


def _compact(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"]
) -> tuple[Int64[np.ndarray, " used"], Int64[np.ndarray, "faces 3"]]:
    """The vertices that faces use, and the faces in their numbers."""
    used, renumbered = np.unique(faces, return_inverse=True)
    return used, renumbered.reshape(-1, 3).astype(np.int64)


def _above_floor(
    vertices: Float64[np.ndarray, "verts 3"], region: Region
) -> Float64[np.ndarray, "verts 3"]:
    """Vertices that decimation put below the floor are put back on it."""
    T = region.T_world_floor
    standing = vertices @ T[:3, :3] - T[:3, 3] @ T[:3, :3]
    standing[:, 2] = np.maximum(standing[:, 2], region.low[2])
    return standing @ T[:3, :3].T + T[:3, 3]


def _closed(faces: Int64[np.ndarray, "faces 3"]) -> bool:
    """Whether every edge has a face on each of its sides."""
    ways = np.concatenate([faces[:, [a, (a + 1) % 3]] for a in range(3)])
    there = ways[np.lexsort(ways.T)]
    back = ways[:, ::-1][np.lexsort(ways[:, ::-1].T)]
    return bool((there == back).all())


def _cut(vertices: Float64[np.ndarray, "verts 3"], region: Region) -> Check:
    T = inverse(region.T_world_floor)
    own = vertices @ T[:3, :3].T + T[:3, 3]
    near = (own < region.low + _WALL) | (own > region.high - _WALL)
    near[:, 2] &= own[:, 2] > region.high[2] - _WALL
    share = float(near.any(axis=1).mean())
    if share <= _CUT:
        return Check("box", "ok", "The object lies within the box that it was looked for in.")
    return Check(
        "box",
        "warn",
        f"{share:.0%} of the surface lie at the sides of the box that the object was looked for in: "
        "part of it may be cut off, or something else touches it.",
        fix="Give a box that is around the object, and free of other things.",
    )


def _shown(
    own: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    seen: Bool[np.ndarray, " verts"],
) -> Check:
    """Check of the share of unseen surface, by area, without the base of the object."""
    area = np.asarray(igl.doublearea(own, faces), np.float64)
    area[(own[faces, 2] < _BASE).all(axis=1)] = 0.0
    unseen = 1 - float((area * seen[faces].mean(axis=1)).sum() / max(area.sum(), 1e-12))
    severity = "bad" if unseen > _UNSEEN_BAD else "warn" if unseen > _UNSEEN_WARN else "ok"
    return graded(
        UNSEEN,
        severity,
        f"{unseen:.0%} of the surface, what it stands on left out, are shown clearly by no two "
        "pictures; there it is only closed.",
        "Film from all around, from lower and from higher too, and into the object where it is open.",
    )


def _tight(watertight: bool, rims: int) -> Check:
    if watertight:
        return Check("closed", "ok", "The surface is closed.")
    return Check(
        "closed",
        "warn",
        f"The surface is not closed ({rims} large holes); a motion can be made with it all the same.",
        fix="Film what is missing, if a hand should hold it there.",
    )


def _decimated(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"], most: int
) -> tuple[Float64[np.ndarray, "fewer 3"], Int64[np.ndarray, "triangles 3"]]:
    """About `most` vertices at most, by quadric edge collapses (Garland and Heckbert 1997).

    Edges are collapsed in the order of what that costs, flat places first; a closed surface stays
    closed.
    """
    if len(vertices) <= most:
        return vertices, faces
    # An orientable manifold is what collapses need; parts that share an edge thrice come apart.
    apart = igl.split_nonmanifold(vertices, faces)
    split, loose = np.asfortranarray(apart[0]), np.asfortranarray(apart[1], dtype=np.int32)
    target = max(4, round(len(loose) * most / len(split)))
    corners, triangles, _, _ = igl.qslim(split, loose, target)
    return np.array(corners, np.float64, order="C"), np.asarray(triangles).astype(np.int64, "C")


def _handed_on(
    old: Float64[np.ndarray, "old 3"],
    new: Float64[np.ndarray, "new 3"],
    colours: UInt8[np.ndarray, "old 3"] | None,
    seen: Bool[np.ndarray, " old"],
) -> tuple[UInt8[np.ndarray, "new 3"] | None, Bool[np.ndarray, " new"]]:
    """Return each new vertex's mean colour of the old ones nearest to it, and whether most were seen.

    Args:
        old, new: vertices, metres.
        colours: of the old ones, where there are any.
        seen: whether a picture shows them.
    """
    nearest_new = KDTree(new).query(old)[1]
    nearest_old = KDTree(old).query(new)[1]
    count = np.bincount(nearest_new, minlength=len(new))
    alone = count == 0

    def mean(values: Float64[np.ndarray, " old"]) -> Float64[np.ndarray, " new"]:
        total = np.bincount(nearest_new, values, minlength=len(new))
        return np.where(alone, values[nearest_old], total / np.maximum(count, 1))

    shown = mean(seen.astype(np.float64)) >= 0.5
    if colours is None:
        return None, shown
    channels = [mean(colours[:, k].astype(np.float64)) for k in range(3)]
    return np.rint(np.stack(channels, axis=1)).astype(np.uint8), shown


def _filled(
    vertices: Float64[np.ndarray, "verts 3"], faces: Int64[np.ndarray, "faces 3"]
) -> tuple[Float64[np.ndarray, "more 3"], Int64[np.ndarray, "triangles 3"], int]:
    """The mesh with its small holes closed, and how many larger ones stay open.

    Vertices and faces that were there stay as they are, the new ones follow.
    """
    longest = _WIDEST * float(np.ptp(vertices, axis=0).max())
    corners, fans, open_ = [vertices], [faces], 0
    count = len(vertices)
    for loop in _rims(faces):
        rim = vertices[loop]
        if np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum() > longest:
            open_ += 1
            continue
        corners.append(rim.mean(axis=0, keepdims=True))
        # Against the way in which the faces beside it go round.
        fans.append(np.stack([np.roll(loop, -1), loop, np.full(len(loop), count)], axis=1))
        count += 1
    return np.concatenate(corners), np.concatenate(fans), open_


def _rims(faces: Int64[np.ndarray, "faces 3"]) -> list[Int64[np.ndarray, " corners"]]:
    """Vertices along each open rim, as the faces beside it go round."""
    return [np.asarray(loop, np.int64) for loop in igl.boundary_loop_all(faces)]


def object_frame(
    vertices: Float64[np.ndarray, "verts 3"], T_world_floor: Float64[np.ndarray, "4 4"]
) -> Float64[np.ndarray, "4 4"]:
    """T_world_object of an object that stands on a floor.

    x runs along the side of the smallest rectangle around the footprint that is nearest to the
    floor's x axis; that rectangle's middle is the origin, the object's lowest vertex at z = 0.

    Args:
        vertices: world, metres.
        T_world_floor: z is the floor's normal.
    """
    standing = (vertices - T_world_floor[:3, 3]) @ T_world_floor[:3, :3]
    base = float(standing[:, 2].min())
    height = float(np.ptp(standing[:, 2]))
    foot = standing[standing[:, 2] < base + max(_FOOT * height, _LEAST_FOOT), :2]
    middle, _, turn = cv2.minAreaRect(foot.astype(np.float32))
    angle = np.radians((turn + 45) % 90 - 45)
    T_floor_object = np.eye(4)
    T_floor_object[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    T_floor_object[:3, 3] = [*middle, base]
    return T_world_floor @ T_floor_object


INVENTED = "_INVENTED"
"""Vertex attribute: 1 where no picture shows the surface and it only closes what was seen."""
_EXACT = 1e6
"""Parts of the atlas's side that tell two places apart."""
FORMATS = (".glb", ".ply", ".obj")


def save_mesh(clean: CleanMesh, path: Path) -> None:
    """Write what `ingest.mesh.load_mesh` reads back as the same mesh; whole or not at all.

    GLB is y up by specification and holds the texture where there is one; the others stay z up and hold
    the colours of the vertices, in sRGB where GLB's are linear.

    Raises:
        InputError: "mesh-format", or those of `whole_file`.
    """
    kind = path.suffix.lower()
    if kind not in FORMATS:
        raise InputError(
            "mesh-format",
            f"A scan cannot be written as {path.name}.",
            where=str(path),
            fix=f"Give a name that ends in {', '.join(FORMATS)}.",
        )
    turn = T_ZUP_ARKIT[:3, :3] if kind == ".glb" else np.eye(3)
    encoded = _trimesh(clean, turn, gltf=kind == ".glb").export(file_type=kind[1:])
    with whole_file(path) as partial:
        partial.write_bytes(encoded.encode() if isinstance(encoded, str) else bytes(encoded))


def _trimesh(clean: CleanMesh, turn: Float64[np.ndarray, "3 3"], *, gltf: bool) -> trimesh.Trimesh:
    """What trimesh writes: it knows no colour spaces, and glTF's colours of vertices are linear."""
    mesh = clean.mesh
    number, faces, visual = np.arange(len(mesh.vertices)), mesh.faces, None
    if gltf and mesh.texture is not None:
        number, faces, visual = _split(mesh.faces, mesh.texture)
    colours = mesh.colours
    if gltf and colours is not None:
        colours = np.rint(255 * to_linear(colours)).astype(np.uint8)
    made = trimesh.Trimesh(
        (mesh.vertices @ turn)[number],
        faces,
        vertex_normals=(clean.normals @ turn)[number],
        vertex_colors=colours if visual is None else None,
        visual=visual,
        process=False,
    )
    made.vertex_attributes[INVENTED] = (~clean.seen[number]).astype(np.float32)
    return made


def _split(
    faces: Int64[np.ndarray, "faces 3"], texture: Texture
) -> tuple[Int64[np.ndarray, " split"], Int64[np.ndarray, "faces 3"], TextureVisuals]:
    """Vertices that lie at several places of the atlas, apart: whose they are, faces, and the look."""
    uv = texture.uv.reshape(-1, 2)
    corners = np.concatenate([faces.reshape(-1, 1), np.rint(uv * _EXACT)], axis=1).astype(np.int64)
    _, first, number = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    material = PBRMaterial(
        baseColorTexture=Image.fromarray(texture.image), metallicFactor=0.0, roughnessFactor=0.9
    )
    # trimesh counts v from below.
    places = uv[first] * [1.0, -1.0] + [0.0, 1.0]
    look = TextureVisuals(uv=places, material=material)
    return corners[first, 0], number.reshape(-1, 3).astype(np.int64), look
