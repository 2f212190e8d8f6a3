"""object_id: which object a mount was found for."""

import numpy as np

from omomo_core.motion import ObjectMesh


def object_id(mesh: ObjectMesh, scale: float = 1.0) -> str:
    """The mesh's name and the box around it in the frame of its file, to a centimetre.

    Another mesh of the same thing in the same frame (a coarser one) has the same id.

    Args:
        mesh: the object.
        scale: what its vertices were multiplied by when the mount's `object_scale` was heeded.
    """
    # Nanometres are dropped so that a side that was scaled and scaled back is rounded as before.
    vertices = np.round(mesh.vertices / scale, 9)
    low, high = (np.round(100 * f(vertices, axis=0)).astype(int) for f in (np.min, np.max))
    size = " x ".join(str(side) for side in high - low)
    return f"{mesh.name}, {size} cm from {' '.join(str(x) for x in low)}"
