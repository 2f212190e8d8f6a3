"""invented_notes: what to tell of hands that hold what a scan only closed and no picture shows."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from jaxtyping import Bool, Float64
from scipy.spatial import KDTree

from ingest.axes import T_ZUP_ARKIT
from ingest.mesh import decoding
from ingest.scan.clean_mesh import INVENTED
from omomo_core.contact.segment import ContactSegment

_HANDS = ("left", "right")
_SHARE = 0.5
"""Part of the surface under a palm that is invented, of what faces the palm."""
_PALM = 0.05
"""Metres around the place under a palm that count."""


class _Marked(NamedTuple):
    """Vertices of a scan's mesh, z up, in the file's unit."""

    vertices: Float64[np.ndarray, "verts 3"]
    normals: Float64[np.ndarray, "verts 3"]
    invented: Bool[np.ndarray, " verts"]
    """Where no picture shows the surface."""


def invented_notes(
    mesh: Path | None, scale: float, segments: Sequence[ContactSegment]
) -> tuple[str, ...]:
    """One note for each hand that rests on invented surface of the object's mesh.

    Args:
        mesh: file of the object's mesh; only what `omocap scan` wrote says what is invented.
        scale: metres of one unit of the file.
        segments: of both hands, with their anchors in the object's frame.
    """
    marked = None if mesh is None else _marked(mesh)
    if marked is None:
        return ()
    tree = KDTree(marked.vertices * scale)
    held = [segment for segment in segments if _on_invented(tree, marked, segment.anchor)]
    return tuple(
        f"The {_HANDS[hand]} palm rests on surface that no picture of the scan shows "
        f"(frames {', '.join(f'{s.start} to {s.stop}' for s in held if s.hand == hand)}); film the "
        "object from there too, or correct the contacts."
        for hand in sorted({segment.hand for segment in held})
    )


def _on_invented(tree: KDTree, marked: _Marked, anchor: np.ndarray) -> bool:
    """Whether most of the surface that faces a palm is invented; the other side of a plate is not held."""
    nearest = tree.query(anchor)[1]
    around = np.asarray(tree.query_ball_point(tree.data[nearest], _PALM))
    ahead = np.einsum("vi,vi->v", marked.normals[around], anchor - tree.data[around]) > 0
    facing = around[ahead] if ahead.any() else around
    return bool(marked.invented[facing].mean() > _SHARE)


def _marked(path: Path) -> _Marked | None:
    """The mesh's marks; None where the file has none."""
    if path.suffix.lower() != ".glb":
        return None
    with decoding(path):
        parts = list(trimesh.load_scene(path, process=False).geometry.values())
    if len(parts) != 1 or INVENTED not in parts[0].vertex_attributes:
        return None
    vertices, normals = (
        np.asarray(part, np.float64) @ T_ZUP_ARKIT[:3, :3].T
        for part in (parts[0].vertices, parts[0].vertex_normals)
    )
    marks = np.asarray(parts[0].vertex_attributes[INVENTED]).reshape(-1)
    return _Marked(vertices, normals, marks > 0.5)
