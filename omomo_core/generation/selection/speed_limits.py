"""Speed limits: where a person's joints and limbs are faster than those of recorded people.

A sample of the networks, or what the solver makes of it, sometimes leaps: the person straddles the object,
turns around within three frames, or throws a foot across the room.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
from jaxtyping import Float
from scipy.ndimage import maximum_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.generation.selection.selection_config import HUMAN_LIMITS, SCORE, SpeedLimits
from omomo_core.geometry.runs import runs
from omomo_core.long_arrays import in_blocks
from omomo_core.motion import FPS, HumanMotion
from omomo_core.skeleton import joint


@dataclass(frozen=True)
class BodyPart:
    """A joint, bone or segment whose speed is measured."""

    name: str
    """Such as "left foot"."""
    limb: str
    """The limb that it belongs to; of each limb only the worst part is reported at a time."""


@dataclass(frozen=True)
class Leap:
    """A stretch of frames in which a limb exceeds a speed limit."""

    part: BodyPart
    quantity: str
    """Field of `SpeedLimits`."""
    start: int
    """Frame in which it begins, and the one in which it has ended."""
    stop: int
    speed: float
    """The greatest, in the unit of its limit."""
    limit: float

    @property
    def turns(self) -> bool:
        """Whether speed and limit are in degrees a second, not metres a second."""
        return self.quantity not in _POINTS


def _sides(name: str, limb: str) -> tuple[BodyPart, ...]:
    return tuple(BodyPart(f"{side} {name}", f"{side} {limb}") for side in ("left", "right"))


PARTS: Mapping[str, tuple[BodyPart, ...]] = {
    "pelvis": (BodyPart("pelvis", "trunk"),),
    "head": (BodyPart("head", "trunk"),),
    "palm": _sides("hand", "arm"),
    "ankle": _sides("foot", "leg"),
    "toe": _sides("foot", "leg"),
    "thigh": _sides("thigh", "leg"),
    "shin": _sides("shin", "leg"),
    "upper_arm": _sides("upper arm", "arm"),
    "forearm": _sides("forearm", "arm"),
    "turn": (BodyPart("pelvis", "heading"), BodyPart("chest", "heading")),
}
"""Parts of each quantity of `SpeedLimits`, in the order of the columns of `measure_speeds`."""
_PALMS = (22, 23)
_POINTS = {"pelvis": (joint("pelvis"),), "head": (joint("head"),), "palm": _PALMS} | {
    name: (joint(f"left_{ours}"), joint(f"right_{ours}"))
    for name, ours in (("ankle", "ankle"), ("toe", "foot"))
}
_BONES = {
    name: tuple((joint(f"{side}_{a}"), joint(f"{side}_{b}")) for side in ("left", "right"))
    for name, a, b in (
        ("thigh", "hip", "knee"),
        ("shin", "knee", "ankle"),
        ("upper_arm", "shoulder", "elbow"),
        ("forearm", "elbow", "wrist"),
    )
}
TURNING = (joint("pelvis"), joint("spine3"))
"""Joints whose turns about the vertical are measured."""


def measure_speeds(
    joints: Float[np.ndarray, "frames 24 3"], turning: Float[np.ndarray, "frames 2 3 3"]
) -> dict[str, Float[np.ndarray, "steps parts"]]:
    """Return the speeds of each quantity of `SpeedLimits` from each frame to the next.

    Args:
        joints: world, metres; NaN where a joint is not known.
        turning: R_world_joint of pelvis and chest.
    """
    moved = {
        name: FPS * np.linalg.norm(np.diff(joints[:, points], axis=0), axis=-1)
        for name, points in _POINTS.items()
    }
    swung = {
        name: np.stack([_swing(joints[:, b] - joints[:, a]) for a, b in bones], axis=1)
        for name, bones in _BONES.items()
    }
    return {**moved, **swung, "turn": _turn(turning)}


def find_leaps(human: HumanMotion, limits: SpeedLimits = HUMAN_LIMITS) -> tuple[Leap, ...]:
    """Return where a person exceeds the limits, in the order of time, once for each limb and stretch.

    A leap names the part of the limb that is farthest beyond its limit: of the parts that move too fast or,
    where none does, of those that turn too fast.
    """
    limit = asdict(limits)
    columns = [
        (PARTS[name][k], name, column)
        for name, values in _speeds_of(human).items()
        for k, column in enumerate(values.T)
    ]
    found: list[Leap] = []
    for limb in dict.fromkeys(part.limb for part, _, _ in columns):
        own = [(part, name, column) for part, name, column in columns if part.limb == limb]
        share = np.stack([column / limit[name] for _, name, column in own])
        for start, stop in runs(share.max(axis=0) > 1):
            beyond = share[:, start:stop].max(axis=1)
            moves = np.array([name in _POINTS for _, name, _ in own]) & (beyond > 1)
            part, name, column = own[int(np.where(moves | ~moves.any(), beyond, 0).argmax())]
            speed = float(column[start:stop].max())
            found.append(Leap(part, name, start, stop, speed, limit[name]))
    return tuple(sorted(found, key=lambda leap: (leap.start, leap.part.name)))


def speed_excess(human: HumanMotion, limits: SpeedLimits = HUMAN_LIMITS) -> float:
    """Return the relative excess of the fastest part over its limit, summed over frames.

    It is 0 without a leap, and 1 for one frame at twice a limit.
    """
    limit, speeds = asdict(limits), _speeds_of(human)
    share = np.concatenate([speeds[name] / limit[name] for name in speeds], axis=1)
    return float((share.max(axis=1) - 1).clip(min=0).sum())


def _speeds_of(human: HumanMotion) -> dict[str, Float[np.ndarray, "steps parts"]]:
    if len(human.joints) <= SCORE.turn_frames:
        return measure_speeds(human.joints, human.rotations[:, TURNING])

    def columns(
        joints: Float[np.ndarray, "frames 24 3"], rotations: Float[np.ndarray, "frames 22 3 3"]
    ) -> Float[np.ndarray, "steps columns"]:
        speeds = measure_speeds(joints, rotations[:, TURNING])
        return np.concatenate([speeds[name] for name in PARTS], axis=1)

    made = in_blocks(columns, human.joints, human.rotations, lost=1)
    ends = np.cumsum([len(parts) for parts in PARTS.values()])[:-1]
    return dict(zip(PARTS, np.split(made, ends, axis=1), strict=True))


def _swing(line: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, " steps"]:
    """Return how fast a line turns from each frame to the next, degrees a second."""
    along = line / np.linalg.norm(line, axis=1, keepdims=True).clip(1e-9)
    cosine = (along[1:] * along[:-1]).sum(axis=1)
    return np.degrees(np.arccos(cosine.clip(-1, 1))) * FPS


def _turn(R: Float[np.ndarray, "frames 2 3 3"]) -> Float[np.ndarray, "steps 2"]:
    """Return the fastest turn about the vertical over a few frames around each step, degrees a second."""
    steps = max(len(R) - 1, 0)
    if steps < SCORE.turn_frames:
        return np.zeros((steps, 2))
    turns = (R[SCORE.turn_frames :] @ R[: -SCORE.turn_frames].swapaxes(-1, -2)).reshape(-1, 3, 3)
    vertical = np.abs(Rotation.from_matrix(turns).as_rotvec()[:, 2]).reshape(-1, 2)
    rate = np.degrees(vertical) * FPS / SCORE.turn_frames
    # A turn over frames t to t + turn_frames is one of every step between them.
    padded = np.pad(rate, ((0, SCORE.turn_frames - 1), (0, 0)))
    return maximum_filter1d(
        padded, SCORE.turn_frames, axis=0, mode="constant", origin=SCORE.turn_frames // 2
    )
