"""Points of the phone matched with points picked on the object's mesh: what has been picked so far."""

from collections.abc import Sequence

import numpy as np
import trimesh
from jaxtyping import Float64

from ingest.calibration.points.correspondences import PointPair
from ingest.calibration.points.fit import PICKING
from omomo_core.motion import ObjectMesh

ENOUGH = 3
POINTS: tuple[str, ...] = (
    "top left back corner",
    "top right back corner",
    "bottom left back corner",
    "bottom right back corner",
    "top middle back",
    "bottom middle back",
    "left middle back",
    "right middle back",
    "top left front corner",
    "top right front corner",
    "bottom left front corner",
    "bottom right front corner",
    "top middle front",
    "bottom middle front",
    "left middle front",
    "right middle front",
    "centre back",
    "centre front",
    "lens",
)
"""Points of the phone that are offered."""


class Picking:
    """The pairs picked so far."""

    def __init__(self, mesh: ObjectMesh, sigma: float = PICKING) -> None:
        self._solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        self._sigma = sigma
        self._pairs: list[PointPair] = []

    @property
    def pairs(self) -> Sequence[PointPair]:
        """In the order picked."""
        return tuple(self._pairs)

    @property
    def enough(self) -> bool:
        """Whether a mount can be tried."""
        return len(self._pairs) >= ENOUGH

    @property
    def left(self) -> Sequence[str]:
        """Points of the phone that are not matched yet."""
        taken = {pair.phone for pair in self._pairs}
        return tuple(name for name in POINTS if name not in taken)

    def hit(
        self, origin: tuple[float, float, float], direction: tuple[float, float, float]
    ) -> Float64[np.ndarray, "3"] | None:
        """Where a ray meets the mesh first, in the object's frame; None beside it."""
        places = self._solid.ray.intersects_location([origin], [direction])[0]
        if len(places) == 0:
            return None
        nearest = np.argmin(np.linalg.norm(places - origin, axis=1))
        return np.asarray(places[nearest], np.float64)

    def pick(
        self,
        name: str,
        origin: tuple[float, float, float],
        direction: tuple[float, float, float],
    ) -> PointPair | None:
        """Match a point of the phone with where the ray meets the mesh; None beside it.

        A point that was matched before moves there.
        """
        place = self.hit(origin, direction)
        if place is None:
            return None
        self._pairs = [pair for pair in self._pairs if pair.phone != name]
        self._pairs.append(
            PointPair(name, (place[0].item(), place[1].item(), place[2].item()), self._sigma)
        )
        return self._pairs[-1]

    def undo(self) -> None:
        """Forget the last pair."""
        self._pairs = self._pairs[:-1]
