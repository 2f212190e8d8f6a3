"""Limbs that swing faster than people's are steadied: elbow or knee, then the way of a free hand or foot.

Solving puts palms and feet exactly where they must be. Where they come and go, and where a limb is nearly
straight, it may turn an upper arm or a thigh within a frame as nobody does.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import gaussian_filter1d, maximum_filter1d
from torch import Tensor

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.limbs import LIMBS, LimbName, reach
from omomo_core.body.model import BodyModel
from omomo_core.generation.selection.selection_config import HUMAN_LIMITS
from omomo_core.generation.selection.speed_limits import TURNING, measure_speeds
from omomo_core.generation.solving.solving_config import STEADY_LIMBS
from omomo_core.geometry.runs import runs
from omomo_core.skeleton import PALM_JOINTS

_LIMITS: dict[str, float] = asdict(HUMAN_LIMITS)


_QUANTITIES = {
    "arm": ("upper_arm", "forearm", "palm"),
    "leg": ("thigh", "shin", "ankle", "toe"),
}
"""Fields of `SpeedLimits` that limbs must keep."""


@dataclass(frozen=True)
class _Swing:
    """A pose of the whole body, and how fast one limb is in it."""

    rotations: Float[Tensor, "frames 22 3 3"]
    joints: Float[np.ndarray, "frames 24 3"]
    share: Float[np.ndarray, " steps"]
    """Speed over its limit from each frame to the next: above 1 the limb leaps."""

    @staticmethod
    def of(
        body: BodyModel,
        root: Float[Tensor, "frames 3"],
        rotations: Float[Tensor, "frames 22 3 3"],
        limb: LimbName,
    ) -> "_Swing":
        side, kind = limb.split("_")
        joints = forward_kinematics(body, root, rotations).double().numpy()
        speeds = measure_speeds(joints, rotations[:, TURNING].double().numpy())
        column = int(side == "right")
        shares = [speeds[name][:, column] / _LIMITS[name] for name in _QUANTITIES[kind]]
        return _Swing(rotations, joints, np.max(shares, axis=0))

    def with_stretch(self, other: "_Swing", start: int, stop: int) -> "_Swing":
        """Return this pose with frames `start` to `stop` of another one if it leaps less there."""
        steps = slice(max(start - 1, 0), stop)
        mine, theirs = (float((x.share[steps] - 1).clip(min=0).sum()) for x in (self, other))
        if theirs >= mine:
            return self
        rotations, joints, share = self.rotations.clone(), self.joints.copy(), self.share.copy()
        rotations[start:stop] = other.rotations[start:stop]
        joints[start:stop] = other.joints[start:stop]
        share[steps] = other.share[steps]
        return _Swing(rotations, joints, share)


def steady_limbs(
    body: BodyModel,
    root: Float[Tensor, "samples frames 3"],
    rotations: Float[Tensor, "samples frames 22 3 3"],
    limbs: Sequence[LimbName],
    held: Float[np.ndarray, "samples frames limbs"],
    free: Float[Tensor, " frames"],
) -> Float[Tensor, "samples frames 22 3 3"]:
    """Return rotations in which limbs leap less; palms and ankles that are held stay where they are.

    Args:
        body: whose limbs.
        root: pelvis joint, world, metres.
        rotations: global R_world_joint.
        limbs: which ones.
        held: how firmly palm or ankle of each is held in its place, in [0, 1].
        free: how far each frame may be changed, in [0, 1].
    """
    out = rotations.clone()
    for k in range(len(out)):
        for n, name in enumerate(limbs):
            may = (1 - held[k, :, n]).clip(0, 1)
            out[k] = _steadied(body, root[k], out[k], name, may, free.numpy())
    return out


def _steadied(
    body: BodyModel,
    root: Float[Tensor, "frames 3"],
    rotations: Float[Tensor, "frames 22 3 3"],
    limb: LimbName,
    may_move: Float[np.ndarray, " frames"],
    free: Float[np.ndarray, " frames"],
) -> Float[Tensor, "frames 22 3 3"]:
    swing = _Swing.of(body, root, rotations, limb)
    for n in range(STEADY_LIMBS.rounds):
        if not (swing.share > 1).any():
            break
        width = STEADY_LIMBS.smoothing * (1 + n)
        near = free * _near(swing.share, width)
        for tip in (np.zeros_like(near), near * may_move):
            steady = _smoothed(body, root, swing, limb, width, near, tip)
            for start, stop in runs(near > 0):
                swing = swing.with_stretch(steady, start, stop)
            if not (swing.share > 1).any():
                break
    return swing.rotations


def _near(share: Float[np.ndarray, " steps"], width: float) -> Float[np.ndarray, " frames"]:
    """Return 1 around leaps, smoothly down to 0 far from them."""
    leaps = np.append(share > 1, False).astype(float)
    around = maximum_filter1d(leaps, 2 * round(STEADY_LIMBS.near + width) + 1)
    weight = gaussian_filter1d(around, STEADY_LIMBS.near / 2)
    return np.where(weight > STEADY_LIMBS.least, weight, 0.0)


def _smoothed(
    body: BodyModel,
    root: Float[Tensor, "frames 3"],
    swing: _Swing,
    limb: LimbName,
    width: float,
    bend: Float[np.ndarray, " frames"],
    tip: Float[np.ndarray, " frames"],
) -> _Swing:
    """Return the pose with one limb smoothed over time: the direction of its bend, and the way of its tip.

    Args:
        body: whose limb.
        root: pelvis joint, world, metres.
        swing: the pose.
        limb: which one.
        width: standard deviation of the filter, frames.
        bend: how far the direction in which elbow or knee points is smoothed, in [0, 1].
        tip: how far the way from shoulder to palm, or from hip to ankle, is.
    """
    joints = LIMBS[limb]
    tip_joint = joints.end if joints.palm is None else 22 + PALM_JOINTS.index(joints.palm)
    upper, middle, end = (swing.joints[:, k] for k in (joints.upper, joints.middle, tip_joint))

    def over_time(x: Float[np.ndarray, "frames 3"], weight: Float[np.ndarray, " frames"]) -> Tensor:
        smooth = gaussian_filter1d(x, width, axis=0, mode="nearest")
        return torch.from_numpy(x + weight[:, None] * (smooth - x))

    way = end - upper
    along = way / np.linalg.norm(way, axis=1, keepdims=True).clip(1e-9)
    out = middle - upper
    pole = over_time(out - (out * along).sum(axis=1, keepdims=True) * along, bend)
    goal = torch.from_numpy(upper) + over_time(way, tip)
    some = torch.from_numpy(bend > 0)
    rotations = swing.rotations.clone()
    solved, _ = reach(
        body,
        root[some],
        rotations[some],
        limb,
        goal[some].to(rotations),
        pole[some].to(rotations),
    )
    rotations[some] = solved
    return _Swing.of(body, root, rotations, limb)
