"""Key frames that can be left out of a GLB while every joint stays within a distance of where it was.

Joints are taken from the hips outwards, on ancestors that are reduced already. A stretch of a joint's
curve is split where the error is largest (Ramer, Douglas and Peucker) until all that hangs on the joint,
held as it is in the full motion, is within the joint's share of the distance. Shares grow with the depth,
so that the last joint of a limb stays within the whole.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.transform import Rotation

from capture_app.exports.exported_take import Take, pose_locals

_TIP = 0.05
"""Metres: points this far along each joint's axes keep the turn of joints on which nothing hangs."""
_LONGEST = 64
"""Frames from one key to the next at most."""

_Keys = Int[np.ndarray, " keys"]


def reduced_keys(take: Take, within: float) -> dict[int, _Keys]:
    """Frames that get a key, of each joint; of the object at -1.

    Args:
        take: in metres.
        within: how far a joint, or a corner of the object, may be from where it was, metres.
    """
    local, parents, frames = pose_locals(take), take.skeleton.parents, len(take.positions)
    hangs = np.eye(len(parents), dtype=bool)
    for j, parent in enumerate(parents):
        hangs[:, j] |= hangs[:, parent] if parent >= 0 else False
    depths = hangs.sum(axis=0)
    world = np.zeros((frames, 3)), np.tile(np.eye(3), (frames, 1, 1))
    done: dict[int, tuple[np.ndarray, np.ndarray]] = {-1: world}
    keys: dict[int, _Keys] = {}
    for j, parent in enumerate(parents):
        R, at = take.rotations[:, j], take.positions[:, j]
        joints = np.einsum("fyx,fny->fnx", R, take.positions[:, hangs[j]] - at[:, None])
        tips = np.broadcast_to(_TIP * np.eye(3), (frames, 3, 3))
        points = np.concatenate([joints, tips], axis=1)
        curve = _Curve(local.positions[:, j], local.rotations[:, j], *done[parent], points, at, R)
        keys[j] = curve.reduced(within * depths[j] / depths.max())
        done[j] = curve.world
    T, low = take.T_world_object, take.mesh.vertices.min(axis=0)
    box = low + np.indices((2, 2, 2)).reshape(3, 8).T * np.ptp(take.mesh.vertices, axis=0)
    corners = np.broadcast_to(box, (frames, 8, 3))
    place, turn = T[:, :3, 3], T[:, :3, :3]
    keys[-1] = _Curve(place, turn, *world, corners, place, turn).reduced(within)
    return keys


@dataclass
class _Curve:
    """A joint's own places and turns, between keys as readers interpolate them."""

    places: Float[np.ndarray, "frames 3"]
    turns: Float[np.ndarray, "frames 3 3"]
    origin: Float[np.ndarray, "frames 3"]
    R_above: Float[np.ndarray, "frames 3 3"]
    """The joint above in the world, reduced."""
    points: Float[np.ndarray, "frames points 3"]
    """What hangs on the joint, in its frame."""
    true_places: Float[np.ndarray, "frames 3"]
    true_turns: Float[np.ndarray, "frames 3 3"]
    """The joint itself in the full motion, world."""

    def reduced(self, within: float) -> _Keys:
        """The frames of the keys; afterwards, places and turns are what remains."""
        last = len(self.places) - 1
        keys = {*range(0, last, _LONGEST), last}
        ends = sorted(keys)
        waiting = list(pairwise(ends))
        full = self.places.copy(), self.turns.copy()
        self.places, self.turns = full[0].copy(), full[1].copy()
        while waiting:
            start, stop = waiting.pop()
            if stop - start < 2:
                continue
            off = self._interpolate(start, stop)
            if off.max() > within:
                middle = start + 1 + int(off.argmax())
                inside = slice(start + 1, stop)
                self.places[inside], self.turns[inside] = full[0][inside], full[1][inside]
                keys.add(middle)
                waiting += [(start, middle), (middle, stop)]
        return np.array(sorted(keys))

    @property
    def world(self) -> tuple[np.ndarray, np.ndarray]:
        """Places and turns of the joint in the world."""
        at = self.origin + np.einsum("fxy,fy->fx", self.R_above, self.places)
        return at, self.R_above @ self.turns

    def _interpolate(self, start: int, stop: int) -> Float[np.ndarray, " inside"]:
        """Lay the frames between two keys on the arc; returns how far that moves what hangs there."""
        inside, share = slice(start + 1, stop), np.arange(1, stop - start) / (stop - start)
        first = Rotation.from_matrix(self.turns[start])
        way = (first.inv() * Rotation.from_matrix(self.turns[stop])).as_rotvec()
        self.turns[inside] = (first * Rotation.from_rotvec(share[:, None] * way)).as_matrix()
        line = self.places[stop] - self.places[start]
        self.places[inside] = self.places[start] + share[:, None] * line
        R = self.R_above[inside]
        at = self.origin[inside] + np.einsum("fxy,fy->fx", R, self.places[inside])
        seen = at[:, None] + np.einsum("fxy,fny->fnx", R @ self.turns[inside], self.points[inside])
        true = np.einsum("fxy,fny->fnx", self.true_turns[inside], self.points[inside])
        true += self.true_places[inside][:, None]
        return np.linalg.norm(seen - true, axis=-1).max(axis=1)
