"""Rotations between the rest poses of another skeleton and ours, so that a pose means the same to both.

Limbs are turned along ours, feet only about the vertical: a foot that stands flat on one skeleton stands
flat on the other, however high its ankle is. Collars are turned until the shoulders are where ours are, seen
from the chest: where collars begin differs from skeleton to skeleton, and SMPL's T-pose raises the
shoulders. The trunk keeps its shape.
"""

import numpy as np
from jaxtyping import Float

from omomo_core.body.kinematics import MODEL_REST
from omomo_core.body.model import BodyModel
from omomo_core.body.soles import ANKLES
from omomo_core.geometry.shortest_turn import shortest_turn
from omomo_core.skeleton import MODEL_ABOVE

LIMBS = {1: 4, 2: 5, 4: 7, 5: 8, 7: 10, 8: 11, 16: 18, 17: 19, 18: 20, 19: 21, 20: 22, 21: 23}
"""Joints that drive one straight bone, and the end of that bone."""
COLLARS = {13: 16, 14: 17}
"""Collars and their shoulders; both collars begin at the chest."""

Offsets = Float[np.ndarray, "24 3"]
"""From each joint's parent to it, at rest, in axes that all joints share, metres."""


def rest_offsets(body: BodyModel) -> Offsets:
    """Return the rest offsets of one of our bodies, in our rest axes."""
    rest = body.rest_joints.double().numpy()[list(MODEL_REST)]
    return rest - rest[list(MODEL_ABOVE)]


def rest_turns(body: BodyModel, theirs: Offsets) -> Float[np.ndarray, "22 3 3"]:
    """Return the smallest rotation of each joint that takes our rest directions to another skeleton's.

    A rotation R of one of their joints is R @ turn in our terms, and a bone of theirs turn^T @ offset.

    Args:
        body: ours.
        theirs: in our rest axes (x left, y up, z forward), but of any size.
    """
    ours, turns = rest_offsets(body), np.tile(np.eye(3), (22, 1, 1))
    for start, end in LIMBS.items():
        axes = [1.0, 0.0, 1.0] if start in ANKLES else [1.0, 1.0, 1.0]
        turns[start] = shortest_turn(ours[end] * axes, theirs[end] * axes)
    for collar, shoulder in COLLARS.items():
        wanted = _onto_line(ours[collar] + ours[shoulder], theirs[collar], theirs[shoulder])
        turns[collar] = shortest_turn(wanted, theirs[shoulder])
    return turns


def _onto_line(
    line: Float[np.ndarray, "3"], start: Float[np.ndarray, "3"], bone: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "3"]:
    """Return the bone, turned about its start until it ends on a line from the origin, or points to it."""
    along = line / np.linalg.norm(line)
    way = (along @ start) * along - start
    farther = np.sqrt(max(float(bone @ bone - way @ way), 0.0))
    return way + farther * along
