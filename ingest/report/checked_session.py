"""A session with values that several checks share."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float64

from ingest.axes import T_ZUP_ARKIT
from ingest.mount import Mount
from ingest.session import CaptureSession
from ingest.trajectory.object_motion import ObjectTake
from ingest.trajectory.rests import find_rests
from ingest.trajectory.segments import Breaks, find_breaks
from ingest.trajectory.smooth import resample
from ingest.trajectory.trajectory_config import BREAKS
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import FPS, ObjectMesh

USEFUL_SECONDS = 3.0
"""A motion shorter than this shows next to nothing of a person."""


@dataclass(frozen=True)
class CheckedSession:
    """A session with values that several checks share, each computed once."""

    session: CaptureSession
    mesh: ObjectMesh | None = None
    """The object, None where the phone alone is looked at."""
    mount: Mount | None = None
    """What `take` was made with; None is the identity."""
    take: ObjectTake | None = None
    """What a run would start from, None when it would refuse the session."""

    @cached_property
    def breaks(self) -> Breaks:
        """Breaks of the tracking, marked on the logged steps."""
        return find_breaks(self.session)

    @cached_property
    def poses(self) -> tuple[Float64[np.ndarray, "frames 4 4"], Bool[np.ndarray, " frames"]]:
        """The phone at 30 fps, z up, and which poses are measured.

        In the take's world, floor at 0; without a take in the session's own, turned z up.
        """
        if self.take is None:
            T, valid = resample(self.session.times, self.session.T_world_phone, self.breaks.any)
            return T_ZUP_ARKIT @ T, valid
        T_object_phone = np.eye(4) if self.mount is None else inverse(self.mount.T_phone_object)
        return self.take.motion.T_world_object @ T_object_phone, self.take.motion.valid

    @cached_property
    def rests(self) -> list[tuple[int, int]]:
        """(start, stop) at 30 fps of each stretch in which the phone stands still."""
        return find_rests(*self.poses)

    @property
    def segments(self) -> list[tuple[int, int]]:
        """(start, stop) at 30 fps of the stretches that a run can use."""
        if self.take is not None:
            return list(self.take.segments)
        return [(a, b) for a, b in runs(self.poses[1]) if b - a >= BREAKS.shortest_segment * FPS]

    @property
    def chosen(self) -> tuple[int, int]:
        """The segment that a run uses; (0, 0) without one."""
        if self.take is not None:
            return self.take.segments[self.take.chosen]
        return max(self.segments, key=lambda span: span[1] - span[0], default=(0, 0))

    @property
    def has_usable(self) -> bool:
        """Whether that is long enough to show something of a person."""
        return self.chosen[1] - self.chosen[0] >= USEFUL_SECONDS * FPS

    @property
    def used(self) -> Bool[np.ndarray, " steps"]:
        """The logged steps within that segment, but for jumps that were stitched."""
        start, stop = self.session.times[0] + np.array(self.chosen) / FPS
        inside = (self.session.times[:-1] >= start) & (self.session.times[1:] <= stop)
        return inside & ~self.breaks.any

    @property
    def object_take(self) -> ObjectTake | None:
        """The take, where the object is known too."""
        return None if self.mesh is None else self.take

    @property
    def up(self) -> Float64[np.ndarray, "3"]:
        """Unit vector in the session's world."""
        T_world_session = T_ZUP_ARKIT if self.take is None else self.take.T_world_arkit
        return T_world_session[2, :3]

    def logged(self, start: int, stop: int) -> tuple[int, int]:
        """The range of logged poses that frames start to stop at 30 fps were made of."""
        times = self.session.times
        grid = times[0] + np.array([start, stop - 1]) / FPS
        first, last = np.searchsorted(times, grid - 1e-6)
        return int(first), min(int(last), len(times) - 1) + 1
