"""check_logged_aim: says before minutes of matching that logged poses do not look at one place."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from ingest.scan.cameras.agreement import AS_LOGGED, readings
from ingest.scan.region.aim import find_aim
from ingest.scan.types import Frame, View
from omomo_core.errors import InputError

_MOST_LOST = 0.2
"""Part of the pictures without a pose beyond which the poses tell nothing."""


def check_logged_aim(frames: Sequence[Frame]) -> None:
    """Check that the cameras look at one place under some reading of their poses.

    Which reading is right is only known once pictures are matched.

    Raises:
        InputError: those of `find_aim`, for the poses as they were logged.
    """
    posed = [(frame, frame.T_world_camera) for frame in frames]
    known = [(frame, T) for frame, T in posed if T is not None and np.isfinite(T).all()]
    if len(known) < (1 - _MOST_LOST) * len(frames) or not known:
        return
    means = readings(np.array([T for _, T in known]))
    failed = {name: _failure([frame for frame, _ in known], T) for name, T in means.items()}
    logged = failed[AS_LOGGED]
    if logged is not None and all(failure is not None for failure in failed.values()):
        raise logged


def _failure(
    frames: Sequence[Frame], T_world_camera: Float64[np.ndarray, "pictures 4 4"]
) -> InputError | None:
    """Why poses have no aim; None where they have one."""
    views = [
        View(frame.name, frame.file, frame.size, np.ones(4), T)
        for frame, T in zip(frames, T_world_camera, strict=True)
    ]
    try:
        find_aim(views)
    except InputError as error:
        return error
    return None
