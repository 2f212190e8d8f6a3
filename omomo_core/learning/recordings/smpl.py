"""Motion in SMPL's terms (AMASS: SMPL-H and SMPL-X npz) on our skeleton, without any licensed body.

Our body joints are SMPL-X's and unrotated in the same T-pose, so rotations carry over as they are. What
a file lacks without its body, the length of the legs, shows in the stride: while a foot stands, the
pelvis travels over it by as much as the leg swings. By how much that T-pose raises the shoulders only the
body tells (`body.rest_turns`): ours end some centimetres lower.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import global_rotations
from omomo_core.body.model import BodyModel
from omomo_core.body.soles import sole_points
from omomo_core.errors import InputError
from omomo_core.learning.recordings.mocap import UNREADABLE, check_rate, not_a_motion, resample
from omomo_core.motion import FPS

AMASS_LICENCE = "AMASS and the licences of its parts (amass.is.tue.mpg.de): not for commercial use"
_RATES = ("mocap_framerate", "mocap_frame_rate", "mocap_fps", "fps")
_SCALE_RANGE = (0.7, 1.5)
"""Our legs to theirs, for people of 1.15 to 2.45 m."""
_FARTHEST = 50.0
"""Metres from the origin that no recording room has."""
_WALKING = 0.3
"""Metres per second of the pelvis from which a stride shows the leg."""
_R_ZUP_YUP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True)
class RecordedMotion:
    """One person's motion on our skeleton at 30 fps, not yet placed on the floor."""

    name: str
    source: str
    licence: str
    root: Float[np.ndarray, "frames 3"]
    """Pelvis, world (z up), metres, scaled to our legs; the height is arbitrary."""
    rotations: Float[np.ndarray, "frames 22 3 3"]
    """Global R_world_joint."""


def is_smpl(path: Path) -> bool:
    """Whether an npz holds SMPL poses (False for files that cannot be read)."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            return "trans" in data and ("poses" in data or "pose_body" in data)
    except UNREADABLE:
        return False


def read_smpl(path: Path, body: BodyModel) -> RecordedMotion:
    """Read an AMASS npz: poses (axis-angle, root first), trans, frame rate; hands are left out.

    Args:
        path: SMPL-H (T, 156) or SMPL-X (T, 165) poses, or root_orient and pose_body; z up.
        body: whose legs the way is scaled to.

    Raises:
        InputError: ``mocap-file``, ``mocap-rate``, ``mocap-empty``, ``mocap-not-finite``,
            ``mocap-units``.
    """
    where = str(path)
    pose, trans, fps = _arrays(path)
    check_rate(fps, where)
    if len(pose) / fps < 0.2:
        raise InputError("mocap-empty", "The clip is shorter than 0.2 s.", where=where)
    bad = np.flatnonzero(~np.isfinite(pose).all((1, 2)) | ~np.isfinite(trans).all(1))
    if len(bad):
        raise InputError(
            "mocap-not-finite", "A channel is not a number.", where=f"{where}, frame {bad[0]}"
        )
    points, rotations = resample(trans[:, None], world_rotations(pose), fps)
    way = points[:, 0]
    up = rotations[:, 0, :, 1].mean(axis=0)
    if up[1] > 0.7 > up[2]:
        way, rotations = way @ _R_ZUP_YUP.T, _R_ZUP_YUP @ rotations
    scale = stride_scale(body, way, rotations)
    if np.abs(way).max() > _FARTHEST or not _SCALE_RANGE[0] < scale < _SCALE_RANGE[1]:
        raise InputError(
            "mocap-units",
            f"The way does not fit the steps (by a factor of {1 / scale:.3g}).",
            where=where,
            fix="The translation must be in metres.",
        )
    return RecordedMotion(path.stem, "amass", AMASS_LICENCE, way * scale, rotations)


def world_rotations(pose: Float[np.ndarray, "frames 22 3"]) -> Float[np.ndarray, "frames 22 3 3"]:
    """Global rotations from axis-angle rotations relative to the parents."""
    local = Rotation.from_rotvec(pose.reshape(-1, 3)).as_matrix().reshape(*pose.shape, 3)
    return global_rotations(torch.from_numpy(local)).numpy()


def stride_scale(
    body: BodyModel,
    way: Float[np.ndarray, "frames 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
) -> float:
    """How many of our metres the pelvis travels for each of the file's; 1 where nobody walks."""
    soles = sole_points(body, np.zeros_like(way), rotations)
    lowest = soles[..., 2].argmin(axis=1)
    swing = np.gradient(soles, axis=0)[np.arange(len(way)), lowest, :2]
    move = np.gradient(way, axis=0)[:, :2]
    square = (move**2).sum(axis=1)
    going = square > (_WALKING / FPS) ** 2
    if going.sum() < FPS:
        return 1.0
    return float(np.median(-(swing * move).sum(axis=1)[going] / square[going]))


def _arrays(
    path: Path,
) -> tuple[Float[np.ndarray, "frames 22 3"], Float[np.ndarray, "frames 3"], float]:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            rate = next((float(data[k]) for k in _RATES if k in data), None)
            trans = np.asarray(data["trans"], float)
            if "poses" in data:
                pose = np.asarray(data["poses"], float)
                pose = pose[:, :66] if pose.ndim == 2 else pose[:, :22]
            else:
                parts = (data["root_orient"], data["pose_body"])
                pose = np.concatenate([np.asarray(p, float) for p in parts], axis=-1)
            pose = pose.reshape(len(pose), 22, 3)
    except UNREADABLE as problem:
        raise not_a_motion(path, problem) from problem
    if rate is None or trans.shape != (len(pose), 3):
        missing = "frame rate" if rate is None else "translation for each pose"
        raise InputError("mocap-file", f"There is no {missing}.", where=str(path))
    return pose, trans, rate
