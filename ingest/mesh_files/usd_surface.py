"""Surfaces of USD stages as they are drawn: meshes and native shapes, instances, visibility, purpose.

What is invisible, a guide or a proxy is not drawn, nor are prototypes where they are defined below their
instancer. Needs usd-core.
"""

from collections import Counter
from collections.abc import Collection, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh
from jaxtyping import Float, Float64, Int, Int64, UInt8
from PIL import Image

from ingest.mesh_files.file_parts import FilePart, too_large
from ingest.mesh_files.usd_stage import UsdTriangles, pxr, triangles_of
from ingest.mesh_texture import BaseColour, to_srgb
from omomo_core.errors import DamageError

_DRAWN = ("default", "render")
_SHAPES = ("Cube", "Sphere", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane")
_SIDES = 48
"""Sides of a native shape that is round."""
_MOST_INSTANCES = 1_000_000

Matrices = Float64[np.ndarray, "copies 4 4"]
"""They multiply row vectors from the right, as USD has them."""


class _Drawn(NamedTuple):
    """A prim that has a surface, and where each of its copies is."""

    prim: Any
    placed: Matrices


class _Visit(NamedTuple):
    prim: Any
    parents: Matrices
    purpose: str
    prototype: bool
    """Whether it stands below an instancer's prototype, where nothing need be defined."""
    root: bool = False
    """Whether its own transform is in `parents` already."""


def first_code(stage: Any) -> float:
    """The time code at which a stage begins."""
    return float(stage.GetStartTimeCode()) if stage.HasAuthoredTimeCodeRange() else 0.0


def bends(prim: Any) -> bool:
    """Whether the shape of a prim changes: its points have time samples, or a skeleton bends it."""
    based = pxr("UsdGeom").PointBased(prim)
    if based and based.GetPointsAttr().GetNumTimeSamples() > 1:
        return True
    return bool(pxr("UsdSkel").BindingAPI(prim).GetInheritedSkeleton())


class UsdSurfaces:
    """Reads what a stage draws at one time code, and keeps account of what it did."""

    def __init__(self, stage: Any, code: float, without: Collection[Any] = ()) -> None:
        """Prepare.

        Args:
            stage: an open stage.
            code: the time code.
            without: paths of prims that are left out with all below them.
        """
        self._stage, self._code, self._without = stage, code, without
        self._usd, self._geom = pxr("Usd"), pxr("UsdGeom")
        self._did: Counter[str] = Counter()
        self._strange: Counter[str] = Counter()
        self._images: dict[int, BaseColour] = {}

    @property
    def notes(self) -> tuple[str, ...]:
        """What was done, or left out."""
        did, notes = self._did, list[str]()
        if did["copies"]:
            notes.append(f"{did['copied']:,} triangles from {did['copies']:,} instances")
        if did["shapes"]:
            notes.append(f"{did['shapes']:,} native shapes as triangles")
        hidden = [f"{did[what]:,} {what}" for what in ("invisible", "guide", "proxy") if did[what]]
        if hidden:
            notes.append(f"not drawn and left out: {', '.join(hidden)}")
        if self._strange:
            notes.append(
                f"left out: {', '.join(f'{n} {kind}' for kind, n in self._strange.items())}"
            )
        return tuple(notes)

    def whole(self) -> Iterator[_Drawn]:
        """All that the stage draws, in its world and its unit."""
        roots = self._stage.GetPseudoRoot().GetChildren()
        rest = np.eye(4)[None]
        yield from self._walk([_Visit(root, rest, "default", False) for root in reversed(roots)])

    def below(self, prim: Any) -> Iterator[_Drawn]:
        """A prim and what is below it, in its own axes and unit; nothing where it is hidden."""
        imageable = self._geom.Imageable(prim)
        if imageable.ComputeVisibility(self._code) == "invisible":
            return
        purpose = str(imageable.ComputePurpose())
        yield from self._walk([_Visit(prim, np.eye(4)[None], purpose, False, root=True)])

    def _walk(self, stack: list[_Visit]) -> Iterator[_Drawn]:
        while stack:
            visit = stack.pop()
            prim, imageable = visit.prim, self._geom.Imageable(visit.prim)
            purpose = visit.purpose
            if imageable:
                if imageable.GetVisibilityAttr().Get(self._code) == "invisible":
                    self._did["invisible"] += 1
                    continue
                own = imageable.GetPurposeAttr()
                purpose = str(own.Get()) if own.HasAuthoredValue() else purpose
            placed = visit.parents if visit.root else self._placed(prim, visit.parents)
            if prim.IsA(self._geom.PointInstancer):
                stack += self._copies(prim, placed, purpose)
                continue
            if prim.IsA(self._geom.Gprim):
                if purpose in _DRAWN:
                    yield _Drawn(prim, placed)
                else:
                    self._did[purpose] += 1
            stack += [
                _Visit(child, placed, purpose, visit.prototype)
                for child in reversed(self._children(prim, visit.prototype))
                if child.GetPath() not in self._without
            ]

    def _children(self, prim: Any, prototype: bool) -> list[Any]:
        wanted = self._usd.PrimIsActive & self._usd.PrimIsLoaded
        if not prototype:
            wanted = wanted & self._usd.PrimIsDefined & ~self._usd.PrimIsAbstract
        return list(prim.GetFilteredChildren(self._usd.TraverseInstanceProxies(wanted)))

    def _placed(self, prim: Any, parents: Matrices) -> Matrices:
        xformable = self._geom.Xformable(prim)
        if not xformable:
            return parents
        own = np.array(xformable.GetLocalTransformation(self._code), np.float64)
        return own[None] if xformable.GetResetXformStack() else own @ parents

    def _copies(self, prim: Any, placed: Matrices, purpose: str) -> Iterator[_Visit]:
        """The prototypes of an instancer, each with the places of all its copies."""
        instancer = self._geom.PointInstancer(prim)
        numbers = np.array(instancer.GetProtoIndicesAttr().Get(self._code) or [], np.int64)
        if len(numbers) * len(placed) > _MOST_INSTANCES:
            raise DamageError(f"it has {len(numbers) * len(placed):,} instances")
        found = instancer.ComputeInstanceTransformsAtTime(
            self._code, self._code, instancer.IncludeProtoXform, instancer.IgnoreMask
        )
        own = np.array(found or [], np.float64).reshape(-1, 4, 4)
        shown = np.array(
            list(instancer.ComputeMaskAtTime(self._code)) or [True] * len(numbers), bool
        )
        if not len(own) == len(shown) == len(numbers):
            raise DamageError("an instancer has fewer places than instances")
        for k, path in enumerate(instancer.GetPrototypesRel().GetForwardedTargets()):
            copies = own[shown & (numbers == k)]
            prototype = self._stage.GetPrimAtPath(path)
            if len(copies) and prototype:
                worlds = (copies[:, None] @ placed[None]).reshape(-1, 4, 4)
                yield _Visit(prototype, worlds, purpose, True, root=True)

    def parts(self, drawn: Iterator[_Drawn], most: int, path: Path) -> list[FilePart]:
        """The surfaces of these prims, all copies of one in one part.

        Args:
            drawn: from `whole` or `below`.
            most: triangles that are read.
            path: the file, for messages.

        Raises:
            InputError: "mesh-too-large".
            Exception: a mesh is damaged.
        """
        found: list[FilePart] = []
        total = 0
        for prim, placed in drawn:
            part = self._part(prim)
            if part is None or not len(part.faces):
                continue
            total += len(part.faces) * len(placed)
            if total > most:
                raise too_large(path, f"{total:,} triangles or more")
            if len(placed) > 1:
                self._did["copies"] += len(placed)
                self._did["copied"] += len(placed) * len(part.faces)
            found += _spread(part, placed)
        return found

    def _part(self, prim: Any) -> FilePart | None:
        """A prim's surface in its own axes."""
        name, kind = str(prim.GetPath()), str(prim.GetTypeName())
        if prim.IsA(self._geom.Mesh):
            read = triangles_of(self._geom.Mesh(prim), self._code)
            painted = picture_on(prim, read.faces, read.corners)
            colours = self._colours(prim, read)
            if painted is None:
                return FilePart(name, read.points, read.faces, colours)
            picture = self._images.setdefault(id(painted[1]), BaseColour(painted[1]))
            return FilePart(name, read.points, read.faces, colours, painted[0], picture)
        if kind not in _SHAPES:
            self._strange[kind] += 1
            return None
        self._did["shapes"] += 1
        shape = native_shape(prim, kind, self._code)
        read = UsdTriangles(shape[0], shape[1], shape[1], np.full(len(shape[1]), 3))
        return FilePart(name, *shape, self._colours(prim, read))

    def _colours(self, prim: Any, read: UsdTriangles) -> UInt8[np.ndarray, "points 3"] | None:
        """Bytes of sRGB of the points; displayColor is linear."""
        primvar = self._geom.Gprim(prim).GetDisplayColorPrimvar()
        told = primvar.ComputeFlattened(self._code) if primvar.HasValue() else None
        values = np.asarray(told if told is not None else [], np.float64).reshape(-1, 3)
        if len(values) == 0:
            return None
        if len(values) == 1:
            return to_srgb(np.tile(values, (len(read.points), 1)))
        kind = str(primvar.GetInterpolation())
        if kind in ("vertex", "varying") and len(values) == len(read.points):
            return to_srgb(values)
        if kind == "faceVarying" and len(values) == read.counts.sum():
            return to_srgb(_mean_at(values[read.corners], read))
        if kind == "uniform" and len(values) == len(read.counts):
            polygon = np.searchsorted(np.cumsum(read.counts), read.corners, side="right")
            return to_srgb(_mean_at(values[polygon], read))
        return None


def _mean_at(
    values: Float64[np.ndarray, "triangles 3 3"], read: UsdTriangles
) -> Float64[np.ndarray, "points 3"]:
    """The mean at each point of values at the corners of triangles."""
    at, count = read.faces.ravel(), len(read.points)
    number = np.maximum(np.bincount(at, minlength=count), 1)
    sums = [np.bincount(at, values[..., k].ravel(), minlength=count) for k in range(3)]
    return np.stack(sums, axis=1) / number[:, None]


def _spread(part: FilePart, placed: Matrices) -> Iterator[FilePart]:
    """Copies of a part as one, and those that are mirrored as another."""
    mirrored = np.linalg.det(placed[:, :3, :3]) < 0
    for flip, T in ((False, placed[~mirrored]), (True, placed[mirrored])):
        if not len(T):
            continue
        vertices = np.einsum("nj,kji->kni", part.vertices, T[:, :3, :3]) + T[:, None, 3, :3]
        faces = part.faces[:, ::-1] if flip else part.faces
        first = np.arange(len(T))[:, None, None] * len(part.vertices)
        places = part.places if part.places is None or not flip else part.places[:, ::-1]
        yield FilePart(
            part.name + (" mirrored" if flip and not mirrored.all() else ""),
            vertices.reshape(-1, 3),
            (faces[None] + first).reshape(-1, 3),
            None if part.colours is None else np.tile(part.colours, (len(T), 1)),
            None if places is None else np.tile(places, (len(T), 1, 1)),
            part.picture,
        )


def native_shape(
    prim: Any, kind: str, code: float
) -> tuple[Float64[np.ndarray, "points 3"], Int64[np.ndarray, "triangles 3"]]:
    """Points and triangles of a native shape in its own axes, round ones with 48 sides.

    Args:
        prim: of the shape.
        kind: its type: Cube, Sphere, Cylinder, Cone, Capsule or Plane.
        code: the time code.

    Raises:
        ValueError: a size is not positive.
    """

    def size(name: str, rest: float) -> float:
        told = prim.GetAttribute(name).Get(code)
        value = rest if told is None else float(told)
        if not 0 < value < float("inf"):
            raise DamageError(f"a {kind} has {name} {value:g}")
        return value

    if kind == "Cube":
        made = trimesh.creation.box([size("size", 2.0)] * 3)
    elif kind == "Sphere":
        made = trimesh.creation.uv_sphere(size("radius", 1.0), count=[_SIDES // 2, _SIDES])
    elif kind == "Plane":
        x, y = size("width", 2.0) / 2, size("length", 2.0) / 2
        corners = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
        made = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    elif kind.startswith("Capsule"):
        radius = size("radius" if kind == "Capsule" else "radiusTop", 0.5)
        made = trimesh.creation.capsule(size("height", 1.0), radius, count=[_SIDES // 2, _SIDES])
    elif kind == "Cone":
        made = trimesh.creation.cone(size("radius", 1.0), size("height", 2.0), sections=_SIDES)
    else:
        radius = size("radius" if kind == "Cylinder" else "radiusTop", 1.0)
        made = trimesh.creation.cylinder(radius, size("height", 2.0), sections=_SIDES)
    vertices = np.array(made.vertices, np.float64)
    vertices -= (vertices.min(axis=0) + vertices.max(axis=0)) / 2 * [0, 0, 1]
    axis = {"X": [2, 0, 1], "Y": [1, 2, 0]}.get(str(prim.GetAttribute("axis").Get() or "Z"))
    turned = vertices if axis is None else vertices[:, axis]
    return turned, np.array(made.faces, np.int64)


def picture_on(
    prim: Any, faces: Int[np.ndarray, "faces 3"], corners: Int[np.ndarray, "faces 3"]
) -> tuple[Float[np.ndarray, "faces 3 2"], Image.Image] | None:
    """Places of the triangles' corners on the picture, and the picture, which is not decoded yet.

    None where the mesh has no picture, several materials, or a picture that cannot be read: it shapes no
    motion.

    Args:
        prim: of the mesh.
        faces: which points are the corners of its triangles.
        corners: which of the polygons' corners these are.
    """
    try:
        sampler = _sampler(prim)
        places = None if sampler is None else _places(prim, sampler, faces, corners)
        if sampler is None or places is None:
            return None
        # USD counts from the bottom left.
        return places * [1.0, -1.0] + [0.0, 1.0], Image.open(BytesIO(_bytes(sampler)))
    except Exception:  # the decoders raise anything on a damaged file
        return None


def _sampler(prim: Any) -> Any:
    """The shader that reads the picture of the diffuse colour."""
    shade = pxr("UsdShade")
    material = shade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    surface = material.ComputeSurfaceSource()[0] if material else None
    colour = surface.GetInput("diffuseColor") if surface else None
    if not colour or not colour.HasConnectedSource():
        return None
    found = shade.Shader(colour.GetConnectedSource()[0].GetPrim())
    return found if found.GetIdAttr().Get() == "UsdUVTexture" else None


def _places(prim: Any, sampler: Any, faces: np.ndarray, corners: np.ndarray) -> np.ndarray | None:
    """Texture coordinates of the triangles' corners."""
    geom, name = pxr("UsdGeom"), "st"
    where = sampler.GetInput("st")
    if where and where.HasConnectedSource():
        reader = pxr("UsdShade").Shader(where.GetConnectedSource()[0].GetPrim())
        told = reader.GetInput("varname")
        name = str(told.Get()) if told and told.Get() else name
    primvar = geom.PrimvarsAPI(prim).GetPrimvar(name)
    if not primvar.HasValue():
        return None
    values = np.array(primvar.ComputeFlattened(), np.float64)
    whole = primvar.GetInterpolation() == geom.Tokens.faceVarying
    return values[corners if whole else faces]


def _bytes(sampler: Any) -> bytes:
    """The picture's file, which lies in the stage's or in its folder."""
    asset = sampler.GetInput("file").Get()
    stage = Path(sampler.GetPrim().GetStage().GetRootLayer().realPath).resolve()
    file = Path(asset.resolvedPath.partition("[")[0]).resolve()
    if not file.is_relative_to(stage.parent):
        raise DamageError(f"{file} lies elsewhere")
    ar = pxr("Ar")
    opened = ar.GetResolver().OpenAsset(ar.ResolvedPath(asset.resolvedPath))
    return bytes(opened.GetBuffer())
