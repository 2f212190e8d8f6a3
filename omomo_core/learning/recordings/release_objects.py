"""The objects of the OMOMO release: scans in arbitrary units, two of them of two parts."""

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float

from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh

_TWO_PARTS = ("mop", "vacuum")
_MOST_VERTICES = 2000
"""The release's scans have ten times as many: more than 4 s of training ever look at."""


class ReleaseObjects:
    """Reads each mesh once, thins it, and brings it to the size it has in a sequence."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._read: dict[str, ObjectMesh] = {}
        self._sized: dict[tuple[str, float], ObjectMesh] = {}

    def mesh(self, sequence: Mapping[str, Any], scale: float, where: str) -> ObjectMesh:
        """The object of a sequence in its own frame, metres times `scale`.

        A mop or vacuum is made one rigid thing, as its parts stand to each other in most frames.

        Raises:
            InputError: ``release-mesh`` when it is missing or damaged, ``release-format`` when the
                sequence's name or its bottom part cannot be used.
        """
        words = str(sequence["seq_name"]).split("_")
        if len(words) < 2:
            raise InputError("release-format", "The name does not tell the object.", where=where)
        name = words[1]
        # To four digits, so that sequences of one size share a mesh.
        size = float(f"{np.median(np.asarray(sequence['obj_scale'])) * scale:.4g}")
        if name in _TWO_PARTS:
            top, bottom = (self._part(f"{name}_cleaned_simplified_{p}") for p in ("top", "bottom"))
            return _resized(_joined(name, sequence, top, bottom, where), size)
        if (name, size) not in self._sized:
            whole = self._part(f"{name}_cleaned_simplified")
            self._sized[name, size] = _resized(whole, size, name)
        return self._sized[name, size]

    def _part(self, part: str) -> ObjectMesh:
        if part not in self._read:
            path = self._folder / f"{part}.obj"
            try:
                solid = trimesh.load_mesh(path, process=False)
                vertices, faces = np.asarray(solid.vertices, float), np.asarray(solid.faces, int)
            except (OSError, ValueError, AttributeError, IndexError, TypeError) as problem:
                raise InputError(
                    "release-mesh", f"The object cannot be read: {problem}.", where=str(path)
                ) from problem
            if len(faces) == 0 or not np.isfinite(vertices).all():
                raise InputError("release-mesh", "The object has no surface.", where=str(path))
            self._read[part] = thinned(ObjectMesh(vertices, faces, part))
        return self._read[part]


def thinned(mesh: ObjectMesh, most: int = _MOST_VERTICES) -> ObjectMesh:
    """The mesh with vertices that share a cell of a grid joined into one, fine enough for `most`."""
    cell = float(np.ptp(mesh.vertices, axis=0).max()) / 400
    while len(mesh.vertices) > most:
        key = np.floor(mesh.vertices / cell).astype(np.int64)
        _, group = np.unique(key, axis=0, return_inverse=True)
        group = group.reshape(-1)
        count = np.bincount(group)
        joined = np.stack([np.bincount(group, mesh.vertices[:, k]) / count for k in range(3)], 1)
        faces = group[mesh.faces]
        whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        mesh = ObjectMesh(joined, np.unique(faces[whole], axis=0), mesh.name)
        cell *= 1.25
    return mesh


def _joined(
    name: str, sequence: Mapping[str, Any], top: ObjectMesh, bottom: ObjectMesh, where: str
) -> ObjectMesh:
    """Both parts in the top's frame and units, as they stand to each other in most frames."""
    R_t, t_t, s_t = _poses(sequence, "obj", where)
    R_b, t_b, s_b = _poses(sequence, "obj_bottom", where)
    if len(R_t) != len(R_b):
        raise InputError("release-format", "'obj_bottom_rot' has another length.", where=where)

    def in_top(points: Float[np.ndarray, "n 3"], k: slice) -> Float[np.ndarray, "frames n 3"]:
        world = s_b[k, None, None] * points @ R_b[k].swapaxes(1, 2) + t_b[k, None]
        return (world - t_t[k, None]) @ R_t[k] / s_t[k, None, None]

    low, high = bottom.vertices.min(axis=0), bottom.vertices.max(axis=0)
    corners = low + (high - low) * list(product((0, 1), repeat=3))
    ways = in_top(corners, slice(None))
    k = int(np.linalg.norm(ways - np.median(ways, axis=0), axis=-1).sum(axis=1).argmin())
    vertices = np.concatenate([top.vertices, in_top(bottom.vertices, slice(k, k + 1))[0]])
    return ObjectMesh(vertices, np.concatenate([top.faces, bottom.faces + len(top.vertices)]), name)


def _poses(
    sequence: Mapping[str, Any], part: str, where: str
) -> tuple[
    Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"], Float[np.ndarray, " frames"]
]:
    shapes: dict[str, tuple[int, ...]] = {"rot": (3, 3), "trans": (3,), "scale": ()}
    found: list[np.ndarray] = []
    for key, shape in shapes.items():
        try:
            found.append(np.asarray(sequence[f"{part}_{key}"], float).reshape(-1, *shape))
        except (KeyError, TypeError, ValueError) as problem:
            what = f"'{part}_{key}' is missing or odd."
            raise InputError("release-format", what, where=where) from problem
        if len(found[-1]) != len(found[0]) or not np.isfinite(found[-1]).all():
            what = f"'{part}_{key}' has another length or is not finite."
            raise InputError("release-format", what, where=where)
    R, t, scale = found
    if not (scale > 0).all():
        raise InputError("release-format", f"'{part}_scale' is not positive.", where=where)
    return R, t, scale


def _resized(mesh: ObjectMesh, size: float, name: str | None = None) -> ObjectMesh:
    return ObjectMesh(
        (mesh.vertices * size).astype(np.float32), mesh.faces.astype(np.int32), name or mesh.name
    )
