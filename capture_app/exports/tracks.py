"""What an animation program needs: y-up tracks of the pelvis, the joints and the object."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float

from capture_app.quaternions import xyzw_from_matrix
from omomo_core.body.kinematics import local_rotations
from omomo_core.motion import FPS, HumanMotion, ObjectMotion

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""R_yup_world: our z up becomes y up, our -y becomes +z."""


@dataclass(frozen=True)
class Tracks:
    """A motion in a right-handed y-up world, metres, seconds; quaternions xyzw."""

    times: Float[np.ndarray, " frames"]
    root: Float[np.ndarray, "frames 3"]
    """Pelvis joint in the world."""
    rotations: Float[np.ndarray, "frames 52 4"]
    """Each joint of ALL_JOINTS relative to its parent; the pelvis, first, relative to the world."""
    object_position: Float[np.ndarray, "frames 3"]
    object_rotation: Float[np.ndarray, "frames 4"]
    """R_yup_object: the mesh keeps its own axes, only its placement turns."""


def y_up_tracks(human: HumanMotion, object_motion: ObjectMotion) -> Tracks:
    """A motion on its way into a y-up file, frame by frame.

    The keys themselves are turned, not a node above the figure: importers that drop such a node
    still stand it upright.
    """
    body = local_rotations(torch.from_numpy(human.rotations)).numpy()
    local = np.concatenate([body, human.fingers], axis=1).astype(np.float64)
    local[:, 0] = Y_UP @ local[:, 0]
    T = object_motion.T_world_object
    return Tracks(
        times=np.arange(len(human.root)) / FPS,
        root=human.root @ Y_UP.T,
        rotations=xyzw_from_matrix(local),
        object_position=T[:, :3, 3] @ Y_UP.T,
        object_rotation=xyzw_from_matrix(Y_UP @ T[:, :3, :3]),
    )
