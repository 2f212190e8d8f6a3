"""From ARKit's world (y up) to ours (z up)."""

import numpy as np

T_ZUP_ARKIT = np.array(
    [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, -1.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]
)
"""Maps (x, y, z) to (x, -z, y): ARKit's y becomes z, the origin stays."""
