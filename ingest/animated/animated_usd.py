"""Animated prims of USD files, with mesh and picture.

An animated prim of a USD stage in one file: its motion, and its mesh. Needs usd-core.

Up axis, metres per unit and time codes per second are the stage's; between time samples USD itself
interpolates, but where they are dense: there poses turn along the sphere, because baked Euler
angles may jump by a whole turn from one sample to the next.
"""

import zipfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Float64, Int
from PIL import Image

from ingest.animated.animated_take import MeshPart, choose, joined, split_stretch
from ingest.animated.animation import (
    MAX_FPS,
    Animation,
    check_times,
    frame_times,
    not_finite,
    sampled,
)
from ingest.mesh_texture import Paint, pixels_of
from ingest.usd_stage import open_stage, pxr, reading_usd, triangles_of
from omomo_core.errors import InputError


def painted(
    prim: Any, faces: Int[np.ndarray, "faces 3"], corners: Int[np.ndarray, "faces 3"]
) -> Paint:
    """Places of the triangles' corners on the picture, and the picture.

    Two times None where the mesh has no picture, several materials, or a picture that cannot be read:
    it shapes no motion.

    Args:
        prim: of the mesh.
        faces: which points are the corners of its triangles.
        corners: which of the polygons' corners these are.
    """
    found = picture_on(prim, faces, corners)
    try:
        return (None, None) if found is None else (found[0], pixels_of(found[1]))
    except Exception:  # the decoders raise anything on a damaged picture
        return None, None


def picture_on(
    prim: Any, faces: Int[np.ndarray, "faces 3"], corners: Int[np.ndarray, "faces 3"]
) -> tuple[Float[np.ndarray, "faces 3 2"], Image.Image] | None:
    """The same with a picture that is not decoded yet."""
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
        raise ValueError(f"{file} lies elsewhere")
    ar = pxr("Ar")
    opened = ar.GetResolver().OpenAsset(ar.ResolvedPath(asset.resolvedPath))
    return bytes(opened.GetBuffer())


NAME = "USD"
FILES = "USD with an animated prim"

_SPARSE = 0.1
"""Seconds between time samples from which on USD's own interpolation is followed."""


def detect(path: Path) -> bool:
    """Whether it is a crate, a text or a packed USD file."""
    with path.open("rb") as file:
        head = file.read(8)
    return head == b"PXR-USDC" or head.startswith(b"#usda") or _packed(path)


def _packed(path: Path) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile):
        return False
    return bool(names) and names[0].endswith((".usd", ".usda", ".usdc"))


def read(path: Path, node: str | None = None) -> Animation:
    """The motion of a prim by itself and its parents, and the mesh of what hangs on it.

    As for glTF: the meshes are those that move rigidly with the prim, scale is applied to them.

    Args:
        path: the file.
        node: the prim's name, or its path (/World/Chair); None where only one that is animated has
            a mesh.

    Raises:
        InputError: "usd-missing" without usd-core; "usd-unreadable", "usd-external", "usd-clock";
            no prim or several fit; its animation is not that of a rigid thing.
    """
    with reading_usd(path):
        return _Stage(path).animation(node)


class _Stage:
    """One USD file and what moves in it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._usd, self._geom = pxr("Usd"), pxr("UsdGeom")
        self._stage = open_stage(path)
        self._rate = float(self._stage.GetTimeCodesPerSecond())
        if not 0 < self._rate < MAX_FPS:
            raise InputError(
                "usd-clock",
                f"The stage has {self._rate:g} time codes a second.",
                where=str(path),
                fix="Set timeCodesPerSecond to the scene's frame rate.",
            )
        self._prims = [p for p in self._stage.Traverse() if p.IsA(self._geom.Xformable)]
        self._moving = {p.GetPath() for p in self._prims if len(self._samples(p)) > 1}

    def animation(self, wanted: str | None) -> Animation:
        full = bool(wanted) and str(wanted).startswith("/")
        names = [str(p.GetPath()) if full else str(p.GetName()) for p in self._prims]
        moving = [i for i, p in enumerate(self._prims) if p.GetPath() in self._moving]
        solid = [i for i in moving if any(True for _ in self._meshes(self._prims[i]))]
        prim = self._prims[choose(names, solid or moving, wanted, self._path)]
        codes = self._codes(prim)
        times = codes / self._rate

        def place(k: int) -> str:
            return f"{self._path}, time code {codes[k]:g}"

        check_times(times, place, self._path)
        T = np.stack([self._placed(prim, code) for code in codes])
        finite = np.isfinite(T).all(axis=(1, 2))
        if not finite.all():
            raise not_finite(place(int(np.argmin(finite))))
        poses, stretch = split_stretch(T, place)
        T_prim_units = np.linalg.inv(self._placed(prim, codes[0]))
        parts = [self._part(mesh, T_prim_units, codes[0]) for mesh in self._meshes(prim)]
        mesh = joined([p for p in parts if len(p.faces)], stretch, str(prim.GetName()), self._path)
        up = "y" if self._geom.GetStageUpAxis(self._stage) == self._geom.Tokens.y else "z"
        moved = sampled(self._path, times, poses, up)
        return Animation(self._path, moved.T_file_object, moved.valid, up, mesh)

    def _samples(self, prim: Any) -> list[float]:
        return list(self._geom.Xformable(prim).GetTimeSamples())

    def _codes(self, prim: Any) -> Float64[np.ndarray, " times"]:
        """Time codes at which the prim or a parent has a sample, and some between distant ones."""
        samples: set[float] = set()
        while prim.IsValid() and not prim.IsPseudoRoot():
            if prim.GetPath() in self._moving:
                samples |= set(self._samples(prim))
            prim = prim.GetParent()
        known = np.array(sorted(samples), np.float64)
        if len(known) == 0:
            return known
        times = known / self._rate
        every = frame_times(float(times[0]), float(times[-1]), self._path)
        after = np.searchsorted(times, every, side="right").clip(1, len(times) - 1)
        sparse = (times[after] - times[after - 1] > _SPARSE) if len(times) > 1 else after < 0
        return np.unique(np.concatenate([known, every[sparse] * self._rate]))

    def _placed(self, prim: Any, code: float) -> Float64[np.ndarray, "4 4"]:
        """Maps the prim's points (its own units) into the world, metres, at a time code."""
        # USD multiplies row vectors from the left.
        matrix = self._geom.Xformable(prim).ComputeLocalToWorldTransform(float(code))
        T = np.array(matrix, np.float64).T
        T[:3] *= self._geom.GetStageMetersPerUnit(self._stage)
        return T

    def _meshes(self, top: Any) -> Iterator[Any]:
        """The meshes that move rigidly with a prim."""
        stack = [top]
        while stack:
            prim = stack.pop()
            if prim.IsA(self._geom.Mesh):
                yield prim
            inside = prim.GetFilteredChildren(self._usd.TraverseInstanceProxies())
            stack += [child for child in inside if child.GetPath() not in self._moving]

    def _part(self, prim: Any, T_top_world: Float64[np.ndarray, "4 4"], code: float) -> MeshPart:
        """Vertices and triangles of a mesh, in the top prim's axes."""
        points, faces, corners = triangles_of(self._geom.Mesh(prim), code)
        part = MeshPart(points, faces, *painted(prim, faces, corners))
        return part.moved(T_top_world @ self._placed(prim, code))
