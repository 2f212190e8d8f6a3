"""Meshes that apps made: their parts and textures, rooms, and COLMAP models.

3D Scanner App, Polycam and Scaniverse export what ARKit meshed in the world of the poses. Seen from the
logged poses it is depth that every picture can have, also where the app saved none.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float32, Float64, Int64, UInt8
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ingest.axes import T_ZUP_ARKIT
from ingest.colmap import read_model
from ingest.formats.still_images import file_inside
from ingest.mesh import MAX_EXTENT, MIN_EXTENT
from ingest.mesh_files.file_parts import (
    MAX_BYTES,
    MAX_FACES,
    FilePart,
    joined_parts,
    joined_picture,
    too_large,
)
from ingest.mesh_files.mesh_file import FORMATS, Y_UP, read_mesh_file
from ingest.mesh_files.usd_stage import open_stage, pxr, reading_usd
from ingest.mesh_files.usd_surface import UsdSurfaces, first_code
from ingest.mesh_texture import texture_colours
from ingest.report.take_report import Check
from ingest.scan.dense.depth_maps import sparse_ratios
from ingest.scan.dense.stereo import DepthMap, DepthMaps, matrix_for, pixel_rays
from ingest.scan.scan_choices import Unit, Up
from ingest.scan.scan_pictures import Stills
from ingest.scan.scan_types import Frame, Registered, ScanMesh, ScanSource
from omomo_core.errors import InputError
from omomo_core.motion import Texture

_USD_SUFFIXES = (".usdz", ".usd", ".usdc", ".usda")
SUFFIXES = (*FORMATS, *_USD_SUFFIXES)
STATES_UP = (*Y_UP, *_USD_SUFFIXES)
"""Kinds of files that say which way is up."""


@dataclass(frozen=True)
class MeshContents:
    """What a mesh file holds, z up if it says which way is up."""

    parts: Mapping[str, FilePart]
    """Parts by the names of their nodes."""
    metres: float | None
    """A unit of the file, where it states that."""
    up: Up | None
    """The axis of the file that is up, where that is known; it is z here."""
    notes: tuple[str, ...] = ()
    """What was done to read it, or left out."""


def read_parts(path: Path, up: Up | None = None) -> MeshContents:
    """Read the meshes of a file. glTF and most USD state that y is up, and are turned.

    Args:
        path: GLB, glTF, OBJ, PLY, STL or USD(Z).
        up: the axis of the file that is up, if somebody knows better than the file.

    Raises:
        InputError: "mesh-missing", "mesh-too-large", "mesh-unreadable", "mesh-empty", "mesh-not-finite",
            "usd-...".
    """
    if not path.is_file():
        raise InputError("mesh-missing", "There is no such mesh file.", where=str(path))
    if path.stat().st_size > MAX_BYTES:
        raise too_large(path, f"{path.stat().st_size / 1e6:.0f} MB")
    kind = path.suffix.lower()
    if kind in _USD_SUFFIXES:
        with reading_usd(path):
            file = _stage_parts(path, up)
    else:
        up = up or ("y" if kind in Y_UP else None)
        read = read_mesh_file(path)
        turn = T_ZUP_ARKIT if up == "y" else np.eye(4)
        parts = {part.name: part.moved(turn) for part in read.parts}
        file = MeshContents(parts, None, up, read.notes)
    found = {name: part for name, part in file.parts.items() if len(part.faces)}
    _check(found, path, file.notes)
    return replace(file, parts=found)


def _check(parts: Mapping[str, FilePart], path: Path, notes: Sequence[str]) -> None:
    if not parts:
        why = "; ".join(notes) or "a point cloud or an empty file"
        raise InputError(
            "mesh-empty",
            f"{path.name} has no triangles ({why}).",
            where=str(path),
            fix="Export the object's surface as triangles.",
        )
    for part in parts.values():
        if not 0 <= part.faces.min() <= part.faces.max() < len(part.vertices):
            raise InputError(
                "mesh-unreadable",
                "A triangle names a vertex that is not there.",
                where=str(path),
                fix="Export the file again.",
            )
        if not np.isfinite(part.vertices).all():
            raise InputError(
                "mesh-not-finite",
                f"{path.name} has vertices that are NaN or infinite.",
                where=str(path),
                fix="Export the mesh again.",
            )


def _stage_parts(path: Path, up: Up | None) -> MeshContents:
    geom, stage = pxr("UsdGeom"), open_stage(path)
    up = up or ("y" if geom.GetStageUpAxis(stage) == geom.Tokens.y else "z")
    turn = T_ZUP_ARKIT if up == "y" else np.eye(4)
    surfaces = UsdSurfaces(stage, first_code(stage))
    read = surfaces.parts(surfaces.whole(), MAX_FACES, path)
    parts = {part.name: part.moved(turn) for part in read}
    return MeshContents(parts, float(geom.GetStageMetersPerUnit(stage)), up, surfaces.notes)


_APART = 0.02
"""Gap between the boxes of two parts, in sizes of the whole, that makes them two objects."""
_CRUMB = 0.02
"""Part of the largest object's faces that another one has at least."""

METRES: dict[Unit, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
NAMES: dict[Unit, str] = {
    "m": "metres", "cm": "centimetres", "mm": "millimetres", "in": "inches", "ft": "feet"
}  # fmt: skip
_PLAUSIBLE = (0.1, 2.5)
"""Metres of the largest side of what people carry, drag or sweep with."""
_USUAL = 0.8
"""Metres; of two plausible units, that which makes the largest side more like this is taken."""


def read_scan_mesh(
    path: Path,
    *,
    name: str | None = None,
    unit: Unit | None = None,
    height: float | None = None,
    up: Up | None = None,
) -> ScanMesh:
    """Read a ready mesh.

    glTF and most USD are y up and turned; other formats state no up axis and stay as they are.

    Args:
        path: GLB, glTF, OBJ, PLY, STL or USD(Z).
        name: of the object in the file, where there are several.
        unit: of the file, where it is known; otherwise what the file says, or guessed.
        height: true extent along z, metres; goes before any unit.
        up: the axis of the file that is up; otherwise what the file says, or z.

    Raises:
        InputError: "mesh-objects", "mesh-object-unknown", "mesh-units", or those of `read_parts`.
    """
    file = read_parts(path, up)
    chosen = _chosen(file.parts, name, path)
    vertices, faces = joined_parts(chosen)
    metres, notes = _metres(np.ptp(vertices, axis=0), unit, file.metres, height, path)
    texture, unread = _texture(chosen, path)
    colours = _colours(chosen, faces, texture)
    how = [Check("file", "ok", f"How it was read: {'; '.join(file.notes)}.")] if file.notes else []
    return ScanMesh(vertices * metres, faces, colours, path.stem, (*how, *notes, *unread), texture)


def _chosen(parts: Mapping[str, FilePart], name: str | None, path: Path) -> list[FilePart]:
    """The parts of the one object; meshes that touch are one object in several pieces."""
    names = list(parts)
    if name is not None:
        picked = [key for key in names if name in (key, key.rsplit("/", 1)[-1])]
        picked = picked or [key for key in names if f"/{name}/" in key]
        picked += [key for key in names if key.startswith(f"{name}/") and key not in picked]
        if not picked:
            raise InputError(
                "mesh-object-unknown",
                f"{path.name} holds nothing called {name!r}.",
                where=str(path),
                fix=f"Give one of {', '.join(names[:12])}.",
            )
        return [parts[key] for key in picked]
    boxes = [(part.vertices.min(axis=0), part.vertices.max(axis=0)) for part in parts.values()]
    label = _together(np.array(boxes))
    faces = np.bincount(label, [len(parts[key].faces) for key in names])
    objects = np.flatnonzero(faces >= _CRUMB * faces.max())
    if len(objects) > 1:
        size = np.array([np.linalg.norm(high - low) for low, high in boxes])
        largest = [names[int(np.where(label == one, size, 0).argmax())] for one in objects]
        raise InputError(
            "mesh-objects",
            f"{path.name} holds {len(objects)} objects that stand apart: {', '.join(largest[:8])}.",
            where=str(path),
            fix="Say which one is meant (‹object_name›), or export it alone.",
        )
    return [parts[key] for key, one in zip(names, label, strict=True) if one == objects[0]]


def _together(bounds: Float64[np.ndarray, "parts 2 3"]) -> np.ndarray:
    """Parts whose bounding boxes touch get the same number."""
    low, high = bounds[:, 0], bounds[:, 1]
    reach = _APART * np.linalg.norm(high.max(axis=0) - low.min(axis=0))
    gap = np.maximum(low[:, None] - high, low - high[:, None]).max(axis=-1)
    return connected_components(coo_array(gap <= reach), directed=False)[1]


def _metres(
    extents: Float64[np.ndarray, "3"],
    unit: Unit | None,
    stated: float | None,
    height: float | None,
    path: Path,
) -> tuple[float, tuple[Check, ...]]:
    """Metres per unit of the file."""
    if height is not None:
        if not 0 < height < 10 or extents[2] <= 0:
            raise InputError(
                "mesh-units",
                f"An object is not {height:g} m high.",
                where=str(path),
                fix="Give its height in metres.",
            )
        return height / float(extents[2]), ()
    if unit is not None:
        return METRES[unit], ()
    metres, notes = _guess_unit(extents * (stated or 1.0), str(path))
    return metres * (stated or 1.0), notes


def _texture(parts: list[FilePart], path: Path) -> tuple[Texture | None, tuple[Check, ...]]:
    """The pictures of the parts joined to one, and what is to be told where that cannot be."""
    try:
        return joined_picture(parts), ()
    except (ValueError, OSError, SyntaxError):  # what Pillow raises on a damaged picture
        message = f"The pictures of {path.name} cannot be used, so it has no texture."
        return None, (
            Check("texture", "warn", message, None, "Export it again, with smaller ones."),
        )


def _colours(
    parts: list[FilePart], faces: Int64[np.ndarray, "faces 3"], texture: Texture | None
) -> UInt8[np.ndarray, "vertices 3"] | None:
    """Colours of the vertices, as the file states them or as the texture has them."""
    if texture is None and all(part.colours is None for part in parts):
        return None
    white = [np.full((len(part.vertices), 3), 255, np.uint8) for part in parts]
    own = [plain if p.colours is None else p.colours for p, plain in zip(parts, white, strict=True)]
    colours = np.concatenate(own)
    if texture is not None:
        stated = np.concatenate([np.full(len(p.faces), p.colours is not None) for p in parts])
        colours[faces[~stated]] = texture_colours(texture)[~stated]
    return colours


def _guess_unit(extents: Float64[np.ndarray, "3"], where: str) -> tuple[float, tuple[Check, ...]]:
    """Metres per unit of a mesh that states none, and what to tell about it.

    Args:
        extents: sides of its bounding box in its own unit.
        where: its file, for messages.

    Raises:
        InputError: "mesh-units" when no unit makes it a thing that a person moves.
    """
    largest = float(extents.max())
    if MIN_EXTENT <= largest <= MAX_EXTENT:
        return 1.0, ()
    sides = " x ".join(f"{side:.4g}" for side in extents)
    likely: list[Unit] = [
        unit
        for unit in ("cm", "mm", "in")
        if _PLAUSIBLE[0] <= largest * METRES[unit] <= _PLAUSIBLE[1]
    ]
    likely.sort(key=lambda unit: abs(np.log(largest * METRES[unit] / _USUAL)))
    if not likely:
        raise InputError(
            "mesh-units",
            f"The mesh measures {sides}; in no unit is that a thing that a person moves.",
            where=where,
            fix="Say its unit (‹unit›), or the true height of the object (‹height›).",
        )
    best, others = likely[0], likely[1:]
    alternatives = "; ".join(
        f"in {NAMES[u]} it would be {largest * METRES[u]:.2f} m" for u in others
    )
    message = (
        f"The mesh measures {sides} and does not say in what; taken for {NAMES[best]}, so that its "
        f"largest side is {largest * METRES[best]:.2f} m"
    )
    message += f" ({alternatives})." if alternatives else "."
    fix = "Measure the object; if that is wrong, say its unit (‹unit›) or its height (‹height›)."
    return METRES[best], (Check("units", "warn", message, None, fix),)


APP = "app"
"""Stands for the mesh that lies in the session's folder."""
_WIDTH = 256
"""Pixels of the depth maps, as many as LiDAR has."""
_FEWEST = 50
"""Sparse points that tell whether the mesh is in the world of the poses."""
_LIKE, _MOST = 0.15, 0.5
"""Part of the depth by which at most half of the points may be off."""


def room_file(said: str, session: Path) -> Path:
    """The file of the room's mesh: as it is given, or the largest in the session for "app".

    Raises:
        InputError: "scan-mesh-missing".
    """
    folder = session if session.is_dir() else session.parent
    if said != APP:
        found = [Path(said)] if Path(said).is_file() else []
    else:
        files = [*folder.glob("*"), *folder.glob("*/*")]
        found = [file for file in files if file.suffix.lower() in SUFFIXES and file.is_file()]
    if not found:
        raise InputError(
            "scan-mesh-missing",
            "There is no mesh of the room.",
            where=str(folder) if said == APP else said,
            fix="Export the scan's mesh (GLB, OBJ, PLY or USDZ) from the phone's app into the session's "
            "folder, or give the file.",
        )
    return max(found, key=lambda file: file.stat().st_size)


def room_depth(
    room: trimesh.Trimesh, registered: Registered, frames: Sequence[Frame], where: str
) -> DepthMaps:
    """Depth of the room's mesh in each view, seen from where the phone logged it; 0 where none is.

    Args:
        room: in the phone's world, z up, metres.
        registered: the views.
        frames: the pictures that were picked, with their logged poses.
        where: the mesh came from, for messages.

    Raises:
        InputError: "scan-mesh-elsewhere" where it is not in the world of the poses.
    """
    logged = {frame.name: frame.T_world_camera for frame in frames}
    maps: list[DepthMap] = []
    for view in registered.views:
        width, height = view.size
        size = (_WIDTH, round(_WIDTH * height / width))
        T = logged.get(view.name)
        known = T is not None and np.isfinite(T).all()
        empty = np.zeros(size[::-1], np.float32)
        maps.append(
            _seen(room, T, matrix_for(view, size), size) if known and T is not None else empty
        )
    ratios = [sparse_ratios(registered, k, depth) for k, depth in enumerate(maps)]
    found = np.concatenate([np.empty(0, np.float32), *ratios])
    off = np.abs(found / np.median(found) - 1) if len(found) else found
    if len(found) < _FEWEST or (off > _LIKE).mean() > _MOST:
        raise InputError(
            "scan-mesh-elsewhere",
            "The mesh of the room does not lie in the world of the phone's poses.",
            where=where,
            fix="Give the mesh that the same app exported of the same recording, unturned.",
        )
    return maps


def _seen(
    room: trimesh.Trimesh,
    T_world_camera: Float64[np.ndarray, "4 4"],
    matrix: Float64[np.ndarray, "3 3"],
    size: tuple[int, int],
) -> Float32[np.ndarray, "h w"]:
    """Depth of the nearest surface in each pixel, metres; 0 where there is none."""
    rays = pixel_rays(size[::-1], matrix).reshape(-1, 3).astype(np.float64)
    directions = rays @ T_world_camera[:3, :3].T
    eyes = np.broadcast_to(T_world_camera[:3, 3], directions.shape)
    places, number, _ = room.ray.intersects_location(eyes, directions, multiple_hits=False)
    depth = np.zeros(len(rays), np.float32)
    depth[number] = (places - T_world_camera[:3, 3]) @ T_world_camera[:3, 2]
    return depth.reshape(size[::-1])


_FILES = (".bin", ".txt")
_INSIDE = ("", "sparse", "colmap/sparse")
_IMAGES = ("images", "../images", "../../images", "../../../images", "..", "../..")
"""Usual folders of a model's pictures, seen from the model."""
MIN_POINTS = 100


def model_in(folder: Path) -> Path | None:
    """The folder of the largest model in a folder, None where there is none."""
    places = [folder / inside for inside in _INSIDE]
    numbered = [sub for place in places if place.is_dir() for sub in sorted(place.glob("[0-9]*"))]
    found = [place for place in [*places, *numbered] if _is_model(place)]
    return max(found, key=_size, default=None)


def _is_model(folder: Path) -> bool:
    return any((folder / f"images{kind}").is_file() for kind in _FILES) and any(
        (folder / f"cameras{kind}").is_file() for kind in _FILES
    )


def _size(folder: Path) -> int:
    files = (folder / f"images{kind}" for kind in _FILES)
    return max(file.stat().st_size for file in files if file.is_file())


def model_source(model: Path, images: Path | None = None) -> ScanSource:
    """The pictures of a COLMAP model.

    Args:
        model: folder with cameras, images and points3D, as .bin or .txt; of any version of COLMAP.
        images: folder of its pictures; looked for beside the model where it is not given.

    Raises:
        InputError: "model-unreadable"; "model-points" when it has next to no points;
            "model-images" when its pictures are not found.
    """
    reconstruction = read_model(model)
    names = sorted(image.name for image in reconstruction.images.values() if image.has_pose)
    if len(reconstruction.points3D) < MIN_POINTS:
        raise InputError(
            "model-points",
            f"The model has {len(reconstruction.points3D)} points: nothing says where its surfaces "
            "are.",
            where=str(model),
            fix="Give a model that was triangulated (points3D is not empty), or give the pictures "
            "themselves to be reconstructed here.",
        )
    folder = images or _images_of(model, names)
    files = {name: file for name in names if (file := file_inside(folder, name)) is not None}
    missing = [name for name in names if name not in files]
    if len(missing) > len(names) // 2:
        raise InputError(
            "model-images",
            f"{len(missing)} of the model's {len(names)} pictures are not there, such as "
            f"{missing[0]}.",
            where=str(folder),
            fix="Give the folder of the pictures that the model was made of (‹images›).",
        )
    # COLMAP reads the pixels as they are stored.
    stills = Stills(tuple(files.values()), tuple(files), 0)
    return ScanSource("colmap", model, stills, model=model)


def _images_of(model: Path, names: list[str]) -> Path:
    """The usual place that holds most of the pictures."""
    places = [(model / place).resolve() for place in _IMAGES]
    counts = [sum(file_inside(place, name) is not None for name in names) for place in places]
    return places[int(np.argmax(counts))]
