"""decimated: fewer vertices, what is known about the old ones handed on to the new ones."""

import igl
import numpy as np
from jaxtyping import Bool, Float64, Int64, UInt8
from scipy.spatial import KDTree


def decimated(
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


def handed_on(
    old: Float64[np.ndarray, "old 3"],
    new: Float64[np.ndarray, "new 3"],
    colours: UInt8[np.ndarray, "old 3"] | None,
    seen: Bool[np.ndarray, " old"],
) -> tuple[UInt8[np.ndarray, "new 3"] | None, Bool[np.ndarray, " new"]]:
    """Of each new vertex: the mean colour of the old ones nearest to it, and whether most were seen.

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
