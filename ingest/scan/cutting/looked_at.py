"""place_looked_at: where the object of a session stands, as the phone was held towards it."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64

from ingest.formats.axes import opencv_poses
from ingest.scan.region.aim import find_aim
from ingest.scan.types import View
from ingest.session import CaptureSession
from omomo_core.errors import InputError

_MOST = 200
"""Poses of a session that are looked at."""


def place_looked_at(session: CaptureSession) -> Float64[np.ndarray, "3"] | None:
    """The point that the camera was held towards, in the phone's world (z up, metres).

    Returns:
        None where it was not held towards one place.
    """
    ok = session.tracking_ok
    T_world_phone = session.T_world_phone if ok is None else session.T_world_phone[ok]
    poses = opencv_poses(T_world_phone[:: max(1, len(T_world_phone) // _MOST)])
    views = [View(str(k), Path(), (1, 1), np.ones(4), pose) for k, pose in enumerate(poses)]
    try:
        return find_aim(views).point
    except InputError:
        return None
