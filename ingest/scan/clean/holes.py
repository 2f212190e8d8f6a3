"""filled: small holes of a mesh closed, each by a fan of triangles."""

import igl
import numpy as np
from jaxtyping import Float64, Int64

_WIDEST = 0.25
"""Part of the mesh's largest side that the rim of a hole may be long; larger ones are openings."""


def filled(
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
