"""What the accelerometer says about up, in the world of the poses."""

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation, Slerp

from ingest.session import R_CAMERA_DEVICE, CaptureSession
from ingest.trajectory.config import VERTICAL


def measured_up(session: CaptureSession) -> Float64[np.ndarray, "windows 3"]:
    """Unit vector against the mean acceleration of each whole two seconds, in the session's world.

    Averaging in the world removes the phone's own acceleration: its velocity stays bounded. None
    (zero rows) without an accelerometer, or when it ran for less than two seconds of the take.
    """
    imu = session.imu
    if imu is None:
        return np.empty((0, 3))
    inside = (imu.times >= session.times[0]) & (imu.times <= session.times[-1])
    times = imu.times[inside]
    if len(times) == 0:
        return np.empty((0, 3))
    R_world_phone = Slerp(session.times, Rotation.from_matrix(session.T_world_phone[:, :3, :3]))
    world = R_world_phone(times).apply(imu.accel[inside] @ R_CAMERA_DEVICE.T)
    window = ((times - times[0]) // VERTICAL.window).astype(int)
    # The last window is not whole; a sum points where the mean does.
    sums = np.stack([np.bincount(window, axis)[:-1] for axis in world.T], axis=1)
    size = np.linalg.norm(sums, axis=1, keepdims=True)
    return -sums[size[:, 0] > 0] / size[size[:, 0] > 0]
