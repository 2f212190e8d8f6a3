"""Sessions in which the phone's clamp slips on the object."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ingest.mount import Mount
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMotion


def slipping(
    motion: ObjectMotion, mount: Mount, slipped: Mount, at: float, seconds: float = 0.3
) -> ObjectMotion:
    """The motion that a phone whose clamp gives way logs, for who believes that it held.

    A phone that is simulated with `mount` on this motion goes as one does on the true motion that
    slides from `mount` to `slipped`.

    Args:
        motion: what the object does.
        mount: before the slip.
        slipped: after it.
        at: seconds from the start at which the clamp begins to give way.
        seconds: that it takes.
    """
    times = np.arange(len(motion.T_world_object)) / FPS
    part = np.clip((times - at) / seconds, 0, 1)
    ends = np.stack([mount.T_phone_object, slipped.T_phone_object])
    T_phone_object = np.tile(np.eye(4), (len(times), 1, 1))
    turning = Slerp([0.0, 1.0], Rotation.from_matrix(ends[:, :3, :3]))
    T_phone_object[:, :3, :3] = turning(part).as_matrix()
    T_phone_object[:, :3, 3] = ends[0, :3, 3] + part[:, None] * (ends[1, :3, 3] - ends[0, :3, 3])
    T_world_phone = motion.T_world_object @ inverse(T_phone_object)
    return replace(motion, T_world_object=T_world_phone @ mount.T_phone_object)
