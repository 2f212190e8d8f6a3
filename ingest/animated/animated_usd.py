"""Animated prims of USD files, with mesh and picture.

An animated prim of a USD stage in one file: its motion, and its mesh. Needs usd-core.

Up axis, metres per unit and time codes per second are the stage's; between time samples USD itself
interpolates, but where they are dense: there poses turn along the sphere, because baked Euler
angles may jump by a whole turn from one sample to the next.
"""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from ingest.animated.animated_take import MeshPart, as_mesh_part, choose, joined, split_stretch
from ingest.animated.animation import (
    MAX_FPS,
    Animation,
    check_times,
    frame_times,
    not_finite,
    not_rigid,
    sampled,
)
from ingest.mesh_files.file_parts import MAX_FACES
from ingest.mesh_files.usd_stage import open_stage, pxr, reading_usd
from ingest.mesh_files.usd_surface import UsdSurfaces, bends, first_code
from omomo_core.errors import InputError

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
        self._geom = pxr("UsdGeom")
        self._stage = open_stage(path)
        self._start = first_code(self._stage)
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
        solid = [i for i in moving if self._solid(self._prims[i])]
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
        parts = [part for part in self._parts(prim, float(codes[0])) if len(part.faces)]
        mesh = joined(parts, stretch, str(prim.GetName()), self._path)
        up = "y" if self._geom.GetStageUpAxis(self._stage) == self._geom.Tokens.y else "z"
        moved = sampled(self._path, times, poses, up)
        notes = not_rigid(*self._not_rigid(prim))
        return Animation(self._path, moved.T_file_object, moved.valid, up, mesh, notes)

    def _not_rigid(self, top: Any) -> tuple[list[str], list[str]]:
        """Names of the parts whose shape changes, and of those that move by themselves."""
        surfaces = UsdSurfaces(self._stage, self._start, self._moving)
        bending = [drawn.prim for drawn in surfaces.below(top) if bends(drawn.prim)]
        below = (p for p in self._prims if p != top and p.GetPath().HasPrefix(top.GetPath()))
        apart = [p for p in below if p.GetPath() in self._moving and self._solid(p)]
        return [str(p.GetName()) for p in bending], [str(p.GetName()) for p in apart]

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

    def _parts(self, prim: Any, code: float) -> list[MeshPart]:
        """Vertices and triangles of what moves rigidly with a prim, in its axes."""
        surfaces = UsdSurfaces(self._stage, code, self._moving)
        read = surfaces.parts(surfaces.below(prim), MAX_FACES, self._path)
        return [as_mesh_part(part) for part in read]

    def _solid(self, prim: Any) -> bool:
        """Whether a surface hangs on a prim."""
        surfaces = UsdSurfaces(self._stage, self._start, self._moving)
        return any(True for _ in surfaces.below(prim))
