"""Readers of recorded human motion: one file or a folder of them becomes SourceMotions."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation, Slerp

from omomo_core.data.bvh import read_bvh
from omomo_core.data.source_skeletons import SOURCE_SKELETONS, SourceSkeleton
from omomo_core.errors import InputError
from omomo_core.motion import FPS

CMU_LICENCE = "CMU motion capture database (mocap.cs.cmu.edu, NSF EIA-0196217): free for all uses"
_R_ZUP_YUP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
_LEG_PER_HEIGHT = 0.491
"""Hip to ankle along the leg, as a part of stature (Winter, Biomechanics of Human Movement)."""
_HEIGHT_RANGE = (1.2, 2.3)
_CMU_LEAD_IN = 8
"""Frames in which the conversion blends its T-pose into the motion."""


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
        """Where a source joint is."""
        return self.positions[:, self.joint_names.index(joint_name)]

    def rotation(self, joint_name: str) -> Float[np.ndarray, "frames 3 3"]:
        """How a source joint is turned."""
        return self.rotations[:, self.joint_names.index(joint_name)]

    def point(self, ours: str) -> Float[np.ndarray, "frames 3"] | None:
        """Where the source joint standing for our joint is, or None when there is none."""
        theirs = self.skeleton.points.get(ours)
        return None if theirs is None else self.position(theirs)


def read_cmu_bvh(path: Path) -> SourceMotion:
    """Read a BVH clip of the CMU database (centimetres, y up; the blended-in T-pose is dropped).

    Raises:
        InputError: as `read_bvh`, and as `checked_motion`.
    """
    bvh = read_bvh(path, metres_per_unit=0.01)
    keep = slice(_CMU_LEAD_IN, None)
    return checked_motion(
        path, bvh.names, bvh.joints[keep], bvh.rotations[keep], bvh.fps, "y", CMU_LICENCE
    )


def read_mocap_npz(path: Path) -> SourceMotion:
    """Read an npz of joints, joint_rot_global_xyzw, joint_names, parents, fps, up, licence.

    Raises:
        InputError: ``mocap-file`` when the file is damaged or lacks a key, and as `checked_motion`.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            quaternions = np.asarray(data["joint_rot_global_xyzw"], float)
            joints = np.asarray(data["joints"], float)
            names = tuple(str(n) for n in data["joint_names"])
            fps, up, licence = float(data["fps"]), str(data["up"]), str(data["licence"])
    except (OSError, KeyError, ValueError) as problem:
        raise InputError(
            "mocap-file", f"This is not a motion file: {problem}.", where=str(path)
        ) from problem
    if not np.isfinite(quaternions).all() or (np.abs(quaternions).max(-1) < 1e-6).any():
        raise InputError("mocap-not-finite", "A rotation is not a number.", where=str(path))
    rotations = Rotation.from_quat(quaternions.reshape(-1, 4)).as_matrix()
    rotations = rotations.reshape(*quaternions.shape[:2], 3, 3)
    return checked_motion(path, names, joints, rotations, fps, up, licence)


def checked_motion(
    path: Path,
    names: tuple[str, ...],
    joints: Float[np.ndarray, "frames joints 3"],
    rotations: Float[np.ndarray, "frames joints 3 3"],
    fps: float,
    up: str,
    licence: str,
) -> SourceMotion:
    """Recognise the skeleton, refuse what cannot be a person, turn z up, resample to 30 fps.

    Raises:
        InputError: ``mocap-skeleton``, ``mocap-not-finite``, ``mocap-empty``, ``mocap-units``.
    """
    where = str(path)
    skeleton = next((s for s in SOURCE_SKELETONS if s.joint_names <= set(names)), None)
    if skeleton is None:
        known = ", ".join(s.name for s in SOURCE_SKELETONS)
        raise InputError(
            "mocap-skeleton",
            f"The skeleton of this motion is not one of {known}.",
            where=where,
            fix="Add a joint map for it to source_skeletons.py.",
        )
    if len(joints) / fps < 0.2:
        raise InputError("mocap-empty", "The clip is shorter than 0.2 s.", where=where)
    bad = np.flatnonzero(~np.isfinite(joints).all((1, 2)) | ~np.isfinite(rotations).all((1, 2, 3)))
    if len(bad):
        raise InputError(
            "mocap-not-finite", "A channel is not a number.", where=f"{where}, frame {bad[0]}"
        )
    if up == "y":
        joints, rotations = joints @ _R_ZUP_YUP.T, _R_ZUP_YUP @ rotations
    joints, rotations = _resample(joints, rotations, fps)
    motion = SourceMotion(path.stem, skeleton, licence, names, joints, rotations)
    height = leg_length(motion) / _LEG_PER_HEIGHT
    if not _HEIGHT_RANGE[0] < height < _HEIGHT_RANGE[1]:
        raise InputError(
            "mocap-units",
            f"The legs are those of a person {height:.3g} m tall, so the units must be wrong.",
            where=where,
            fix="Convert the file to metres (BVH: centimetres).",
        )
    return motion


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


def read_mocap_folder(
    folder: Path, *, share_alike: bool = True, skipped: Counter[str] | None = None
) -> Iterator[SourceMotion]:
    """Every usable clip below a folder, in the order of their paths.

    Args:
        folder: holds .bvh (CMU, centimetres) and .npz files at any depth.
        share_alike: False leaves out motion under share-alike licences.
        skipped: counts the clips left out by error code.

    Raises:
        InputError: ``mocap-folder`` when the folder has no motion file. Bad clips are skipped.
    """
    files = sorted(f for f in folder.rglob("*") if f.suffix.lower() in (".bvh", ".npz"))
    if not files:
        raise InputError(
            "mocap-folder", "There are no .bvh or .npz motion files here.", where=str(folder)
        )
    for path in files:
        try:
            motion = read_cmu_bvh(path) if path.suffix.lower() == ".bvh" else read_mocap_npz(path)
        except InputError as problem:
            if skipped is not None:
                skipped[problem.code] += 1
            continue
        if share_alike or not is_share_alike(motion):
            yield motion


def _resample(
    joints: Float[np.ndarray, "frames joints 3"],
    rotations: Float[np.ndarray, "frames joints 3 3"],
    fps: float,
) -> tuple[Float[np.ndarray, "out joints 3"], Float[np.ndarray, "out joints 3 3"]]:
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
