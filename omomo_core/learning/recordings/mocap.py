"""Readers of recorded human motion on a skeleton of its own: a file becomes a SourceMotion."""

import zlib
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp

from omomo_core.errors import InputError
from omomo_core.learning.recordings.bvh_file import Bvh, read_bvh
from omomo_core.learning.recordings.source_skeletons import (
    CMU_BVH,
    SOURCE_SKELETONS,
    SourceSkeleton,
    recognise_rig,
    upright,
)
from omomo_core.motion import FPS

CMU_LICENCE = "CMU motion capture database (mocap.cs.cmu.edu, NSF EIA-0196217): free for all uses"
OWN_LICENCE = "as the owner of the recordings gave it"
METRES_PER_BVH_UNIT = 0.01
"""BVH does not say its unit; nearly every program writes centimetres."""
R_ZUP = {
    "x": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "z": np.eye(3),
}
"""Axis that points up in a file -> rotation into our world."""
_LEG_PER_HEIGHT = 0.491
"""Hip to ankle along the leg, as a part of stature (Winter, Biomechanics of Human Movement)."""
_HEIGHT_RANGE = (1.2, 2.3)
UNREADABLE = (OSError, EOFError, KeyError, TypeError, ValueError, BadZipFile, zlib.error)
"""What numpy raises on files that are no npz, or no whole one."""
_FPS_RANGE = (5.0, 1000.0)
_CMU_LEAD_IN = 8
"""Frames in which the conversion blends its T-pose into the motion."""
_FASTEST = 20.0
"""Metres per second that no limb reaches: a first frame left so fast is a pose for calibration."""


@dataclass(frozen=True)
class SourceMotion:
    """A recording on its own skeleton at 30 fps."""

    name: str
    skeleton: SourceSkeleton
    licence: str
    joint_names: tuple[str, ...]
    positions: Float[np.ndarray, "frames joints 3"]
    """World, z up, metres."""
    rotations: Float[np.ndarray, "frames joints 3 3"]
    """Global, from the joint's local frame (see SourceSkeleton.rest_forward) to the world."""

    def position(self, joint_name: str) -> Float[np.ndarray, "frames 3"]:
        """Return the position of a source joint."""
        return self.positions[:, self.joint_names.index(joint_name)]

    def rotation(self, joint_name: str) -> Float[np.ndarray, "frames 3 3"]:
        """How a source joint is turned."""
        return self.rotations[:, self.joint_names.index(joint_name)]

    def point(self, ours: str) -> Float[np.ndarray, "frames 3"] | None:
        """Return the position of the source joint that stands for ours; None when there is none."""
        theirs = self.skeleton.points.get(ours)
        return None if theirs is None else self.position(theirs)


def read_bvh_motion(path: Path, metres_per_unit: float = METRES_PER_BVH_UNIT) -> SourceMotion:
    """Read a BVH clip of the CMU database or of any rig that `recognise_rig` knows.

    Args:
        path: the file, with any of its axes up.
        metres_per_unit: length of one unit of the file.

    Raises:
        InputError: as `read_bvh`, and as `checked_motion`.
    """
    bvh = read_bvh(path, metres_per_unit=metres_per_unit)
    if CMU_BVH.joint_names <= set(bvh.names):
        # The lead-in is a T-pose that blends into the motion.
        keep, up, licence, skeleton = slice(_CMU_LEAD_IN, None), "y", CMU_LICENCE, CMU_BVH
    else:
        skeleton = recognise_rig(bvh.names, bvh.parents, bvh.rest)
        if skeleton is None:
            raise _unknown_skeleton(path)
        keep, up, licence = slice(_first_frame(bvh), None), _up_axis(bvh, skeleton), OWN_LICENCE
    return checked_motion(
        path, bvh.names, bvh.joints[keep], bvh.rotations[keep], bvh.fps, up, licence, skeleton
    )


def _first_frame(bvh: Bvh) -> int:
    """1 when the recording begins with a pose that it jumps away from."""
    if len(bvh.joints) < 3:
        return 0
    local = bvh.joints[:2] - bvh.joints[:2, :1]
    return int(np.linalg.norm(np.diff(local, axis=0), axis=-1).max() * bvh.fps > _FASTEST)


def _up_axis(bvh: Bvh, skeleton: SourceSkeleton) -> str:
    """The file's axis along which people mostly hold their trunks."""
    up = upright(skeleton, bvh.names, bvh.joints)
    if np.abs(up).max() < 0.7 and skeleton.rest_axes is not None:
        up = skeleton.rest_axes[:, 1]
    return "xyz"[int(np.abs(up).argmax())]


def read_mocap_npz(path: Path) -> SourceMotion:
    """Read an npz of joints, joint_rot_global_xyzw, joint_names, parents, fps, up, licence.

    Raises:
        InputError: ``mocap-file`` when the file is damaged or lacks a key, and as `checked_motion`.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            quaternions = np.asarray(data["joint_rot_global_xyzw"], float)
            joints = np.asarray(data["joints"], float)
            names = tuple(str(n) for n in data["joint_names"])
            fps, up, licence = float(data["fps"]), str(data["up"]), str(data["licence"])
    except UNREADABLE as problem:
        raise not_a_motion(path, problem) from problem
    if not np.isfinite(quaternions).all() or (np.abs(quaternions).max(-1) < 1e-6).any():
        raise InputError("mocap-not-finite", "A rotation is not a number.", where=str(path))
    rotations = Rotation.from_quat(quaternions.reshape(-1, 4)).as_matrix()
    rotations = rotations.reshape(*quaternions.shape[:2], 3, 3)
    return checked_motion(path, names, joints, rotations, fps, up, licence)


def not_a_motion(path: Path, problem: Exception) -> InputError:
    """What to say of a file that numpy would not read, or that lacks an array."""
    why = f"{problem}"
    if "pickle" in why:  # numpy advises to load it unsafely
        why = "it is damaged, or holds Python objects, which are never loaded"
    return InputError("mocap-file", f"This is not a motion file: {why}.", where=str(path))


def checked_motion(
    path: Path,
    names: tuple[str, ...],
    joints: Float[np.ndarray, "frames joints 3"],
    rotations: Float[np.ndarray, "frames joints 3 3"],
    fps: float,
    up: str,
    licence: str,
    skeleton: SourceSkeleton | None = None,
) -> SourceMotion:
    """Recognise the skeleton, refuse what cannot be a person, turn z up, resample to 30 fps.

    Raises:
        InputError: ``mocap-skeleton``, ``mocap-not-finite``, ``mocap-empty``, ``mocap-rate``,
            ``mocap-file`` (shapes), ``mocap-units``.
    """
    where = str(path)
    skeleton = skeleton or next((s for s in SOURCE_SKELETONS if s.joint_names <= set(names)), None)
    if skeleton is None:
        raise _unknown_skeleton(path)
    if joints.shape != (*rotations.shape[:2], 3) or joints.shape[1] != len(names):
        raise InputError("mocap-file", "Joints, rotations and names do not match.", where=where)
    if up not in R_ZUP:
        raise InputError("mocap-file", f"'{up}' is no axis that could be up.", where=where)
    check_rate(fps, where)
    if len(joints) / fps < 0.2:
        raise InputError("mocap-empty", "The clip is shorter than 0.2 s.", where=where)
    bad = np.flatnonzero(~np.isfinite(joints).all((1, 2)) | ~np.isfinite(rotations).all((1, 2, 3)))
    if len(bad):
        raise InputError(
            "mocap-not-finite", "A channel is not a number.", where=f"{where}, frame {bad[0]}"
        )
    joints, rotations = joints @ R_ZUP[up].T, R_ZUP[up] @ rotations
    joints, rotations = resample(joints, rotations, fps)
    motion = SourceMotion(path.stem, skeleton, licence, names, joints, rotations)
    check_legs(leg_length(motion), where)
    return motion


def check_rate(fps: float, where: str) -> None:
    """Refuse frame rates at which nobody records.

    Raises:
        InputError: ``mocap-rate``.
    """
    if not _FPS_RANGE[0] <= fps <= _FPS_RANGE[1]:
        raise InputError("mocap-rate", f"{fps:g} frames a second cannot be right.", where=where)


def check_legs(length: float, where: str) -> None:
    """Refuse legs (thigh and shin, metres) that no grown person has.

    Raises:
        InputError: ``mocap-units``.
    """
    height = length / _LEG_PER_HEIGHT
    if not _HEIGHT_RANGE[0] < height < _HEIGHT_RANGE[1]:
        raise InputError(
            "mocap-units",
            f"The legs are those of a person {height:.3g} m tall, so the units must be wrong.",
            where=where,
            fix="Convert the file to metres (BVH: centimetres, or say the unit with ‹bvh_unit›).",
        )


def _unknown_skeleton(path: Path) -> InputError:
    known = ", ".join(s.name for s in SOURCE_SKELETONS)
    return InputError(
        "mocap-skeleton",
        f"The skeleton of this motion is neither {known} nor a common animation rig.",
        where=str(path),
        fix="Rename its joints as Mixamo does (Hips, Spine, LeftUpLeg, LeftLeg, LeftFoot...).",
    )


def leg_length(motion: SourceMotion) -> float:
    """Length of thigh and shin together, mean of both sides, metres."""
    total = 0.0
    for side in ("left", "right"):
        hip, knee, ankle = (
            motion.position(motion.skeleton.points[f"{side}_{p}"]) for p in ("hip", "knee", "ankle")
        )
        for a, b in ((hip, knee), (knee, ankle)):
            total += float(np.median(np.linalg.norm(b - a, axis=-1)))
    return total / 2


def is_share_alike(motion: SourceMotion) -> bool:
    """True when the licence demands that what is made from the motion carries the same licence."""
    return "BY-SA" in motion.licence


def resample(
    joints: Float[np.ndarray, "frames points 3"],
    rotations: Float[np.ndarray, "frames joints 3 3"],
    fps: float,
) -> tuple[Float[np.ndarray, "out points 3"], Float[np.ndarray, "out joints 3 3"]]:
    """To 30 fps by time: positions linearly, rotations along the shortest arc."""
    times = np.arange(len(joints)) / fps
    wanted = np.arange(0.0, times[-1] + 1e-6, 1.0 / FPS).clip(0.0, times[-1])
    step = fps / FPS
    if abs(step - round(step)) < 1e-4:
        return joints[:: round(step)].copy(), rotations[:: round(step)].copy()
    left = np.searchsorted(times, wanted, side="right").clip(1, len(times) - 1) - 1
    t = ((wanted - times[left]) * fps)[:, None, None]
    moved = joints[left] * (1 - t) + joints[left + 1] * t
    turned = [
        Slerp(times, Rotation.from_matrix(rotations[:, j]))(wanted).as_matrix()
        for j in range(rotations.shape[1])
    ]
    return moved, np.stack(turned, axis=1)
