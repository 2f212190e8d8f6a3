"""The objects of the OMOMO release: scans in arbitrary units, two of them of two parts."""

from collections.abc import Mapping
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

        A mop or vacuum is made one rigid thing, as it is in the middle of the sequence.

        Raises:
            InputError: ``release-mesh`` when it is missing or damaged, ``release-format`` when the
                sequence's name or its bottom part cannot be used.
        """
        words = str(sequence["seq_name"]).split("_")
        if len(words) < 2:
            raise InputError("release-format", "The name does not tell the object.", where=where)
        name = words[1]
        size = round(float(np.median(np.asarray(sequence["obj_scale"]))) * scale, 4)
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
    """Both parts in the top's frame and units."""
    try:
        k = len(sequence["obj_rot"]) // 2
        R_t, t_t, s_t = _pose(sequence, "obj", k)
        R_b, t_b, s_b = _pose(sequence, "obj_bottom", k)
    except (KeyError, IndexError, TypeError, ValueError) as problem:
        raise InputError("release-format", "The bottom part is missing.", where=where) from problem
    world = s_b * bottom.vertices @ R_b.T + t_b
    vertices = np.concatenate([top.vertices, (world - t_t) @ R_t / s_t])
    return ObjectMesh(vertices, np.concatenate([top.faces, bottom.faces + len(top.vertices)]), name)


def _pose(
    sequence: Mapping[str, Any], part: str, frame: int
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"], float]:
    rotation = np.asarray(sequence[f"{part}_rot"][frame], float).reshape(3, 3)
    offset = np.asarray(sequence[f"{part}_trans"][frame], float).reshape(3)
    scale = float(np.asarray(sequence[f"{part}_scale"][frame]).reshape(-1)[0])
    if not (np.isfinite(rotation).all() and np.isfinite(offset).all() and scale > 0):
        raise ValueError("not finite")
    return rotation, offset, scale


def _resized(mesh: ObjectMesh, size: float, name: str | None = None) -> ObjectMesh:
    return ObjectMesh(
        (mesh.vertices * size).astype(np.float32), mesh.faces.astype(np.int32), name or mesh.name
    )
