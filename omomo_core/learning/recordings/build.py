"""Training clips on our skeleton from a folder of recordings."""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.body.soles import sole_points
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.learning.recordings.calibration import Corrections, calibrate
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import Grounded, ground
from omomo_core.learning.recordings.joint_angles import SIDES, elbow
from omomo_core.learning.recordings.mocap import (
    METRES_PER_BVH_UNIT,
    SourceMotion,
    is_share_alike,
    leg_length,
)
from omomo_core.learning.recordings.recordings import motion_files, read_recordings
from omomo_core.learning.recordings.smpl import RecordedMotion
from omomo_core.motion import FPS
from omomo_core.skeleton import BODY_JOINTS, joint

_SHORTEST = round(0.8 * FPS)
_STEP_HEIGHT = 0.09
"""The level stood on may differ this much from the clip's usual one, metres; more is climbing."""
_DEEPEST_SOLE = -0.08
_LOWEST_PELVIS = 0.22
_LOWEST_HEAD = 0.45
"""Metres; lower means lying, rolling or a handstand, which nobody does while carrying."""
_WORST_SKATING = 0.3
_ELBOW = (-15.0, 165.0)
"""Degrees of bending: beyond, the recording is broken."""
_EDGE = round(0.1 * FPS)
"""Frames also dropped around a bad one."""

Progress = Callable[[int, int], None]
"""Called with files done and files in all."""


def build_mocap(
    folder: Path,
    body: BodyModel,
    *,
    share_alike: bool = True,
    progress: Progress | None = None,
    dropped: Counter[str] | None = None,
    skipped: list[InputError] | None = None,
    metres_per_unit: float = METRES_PER_BVH_UNIT,
    object_split: bool = False,
) -> list[Clip]:
    """Read, retarget and ground every usable stretch of human motion below a folder.

    Args:
        folder: recordings of any kind `read_recordings` knows, or one of them.
        body: whose proportions the clips get.
        share_alike: False leaves out motion under share-alike licences (HDM05).
        progress: called after each recording.
        dropped: counts what was left out by reason.
        skipped: gets the error of each file that was left out.
        metres_per_unit: of the BVH files.
        object_split: of the OMOMO release, only the paper's ten objects of training.

    Returns:
        Clips at least 0.8 s long, standing on the floor; those of the OMOMO release with objects.

    Raises:
        InputError: ``mocap-folder`` when the folder holds no motion file, ``mocap-unusable`` when
            none of them can be used.
    """
    refused: list[InputError] = [] if skipped is None else skipped
    counts = Counter[str]() if dropped is None else dropped
    clips: list[Clip] = []
    motions: list[SourceMotion] = []
    files = motion_files(folder)
    for done, path in enumerate(files, start=1):
        for found in read_recordings(path, body, metres_per_unit, object_split=object_split):
            if isinstance(found, InputError):
                refused.append(found)
                counts[found.code] += 1
            elif isinstance(found, SourceMotion):
                if share_alike or not is_share_alike(found):
                    motions.append(found)
            elif isinstance(found, RecordedMotion):
                clips += standing_clips(found, body, counts)
            else:
                clips.append(found)
        if progress is not None:
            progress(done, len(files))
    clips += _retargeted(motions, body, counts)
    if not clips:
        reasons = ", ".join(f"{count} x {reason}" for reason, count in counts.most_common())
        raise InputError(
            "mocap-unusable",
            f"None of {len(files)} motion files can be used ({reasons or 'none is asked for'}).",
            where=str(folder),
            fix=str(refused[0]) if refused else "Give recordings of people who stand and walk.",
        )
    return clips


def _retargeted(
    motions: Sequence[SourceMotion], body: BodyModel, dropped: Counter[str]
) -> list[Clip]:
    """Clips of recordings on skeletons that must be calibrated, each from all its recordings."""
    families: dict[str, list[SourceMotion]] = defaultdict(list)
    for motion in motions:
        families[motion.skeleton.name].append(motion)
    corrections = {name: calibrate(family, body) for name, family in families.items()}
    clips: list[Clip] = []
    for motion in motions:
        clips += mocap_clips(motion, corrections[motion.skeleton.name], body, dropped)
    return clips


def mocap_clips(
    motion: SourceMotion,
    corrections: Corrections,
    body: BodyModel,
    dropped: Counter[str] | None = None,
) -> Iterator[Clip]:
    """Yield the stretches of one recording in which the actor stands or moves on one level floor.

    Args:
        motion: a recording.
        corrections: of its skeleton, from `calibrate`.
        body: whose proportions the clips get.
        dropped: counts recordings that skate (``skating``) or have no good stretch (``no-floor``).
    """
    root, rotations = retarget(motion, corrections, body)
    moved = RecordedMotion(motion.name, motion.skeleton.name, motion.licence, root, rotations)
    return standing_clips(moved, body, dropped)


def standing_clips(
    performance: RecordedMotion, body: BodyModel, dropped: Counter[str] | None = None
) -> Iterator[Clip]:
    """Yield clips as `mocap_clips` does, from motion that is already on our skeleton."""
    grounded = ground(body, performance.root, performance.rotations)
    reason = "skating" if grounded.skating > _WORST_SKATING else "no-floor"
    stretches = [] if reason == "skating" else runs(_usable(body, grounded))
    stretches = [(a, b) for a, b in stretches if b - a >= _SHORTEST]
    if not stretches and dropped is not None:
        dropped[reason] += 1
    name = performance.name
    for k, (first, last) in enumerate(stretches):
        part = slice(first, last)
        yield Clip(
            name=name if len(stretches) == 1 else f"{name}#{k}",
            source=performance.source,
            licence=performance.licence,
            root=grounded.root[part],
            rotations=grounded.rotations[part],
            hand_contact=np.zeros((last - first, 2)),
            foot_contact=grounded.foot_contact[part],
            object_motion=None,
        )


def _usable(body: BodyModel, grounded: Grounded) -> Bool[np.ndarray, " frames"]:
    joints = joints_of(body, grounded.root, grounded.rotations)
    soles = sole_points(body, grounded.root, grounded.rotations)
    bad = np.abs(grounded.level - np.median(grounded.level)) > _STEP_HEIGHT
    bad |= soles[..., 2].min(axis=1) < _DEEPEST_SOLE
    bad |= joints[:, 0, 2] < _LOWEST_PELVIS
    bad |= joints[:, joint("head"), 2] < _LOWEST_HEAD
    for side in SIDES:
        flexion = elbow(grounded.rotations, side).flexion
        bad |= (flexion < _ELBOW[0]) | (flexion > _ELBOW[1])
    spread = np.convolve(bad, np.ones(2 * _EDGE + 1), mode="same") > 0
    return ~spread


def retarget(
    motion: SourceMotion, corrections: Corrections, body: BodyModel
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Return a recorded motion on our skeleton: rotations carried over, the root scaled by leg length.

    Args:
        motion: a recording.
        corrections: of its skeleton, from `calibrate`.
        body: whose proportions to fit.

    Returns:
        Root (world, metres, not yet placed on the floor) and global R_world_joint.
    """
    rotations = np.stack([_turned(motion, corrections, name) for name in BODY_JOINTS], axis=1)
    rest = body.rest_joints.double().numpy()
    our_leg = sum(
        float(np.linalg.norm(rest[joint(f"left_{b}")] - rest[joint(f"left_{a}")]))
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    )
    points = motion.skeleton.points
    hips = (motion.position(points["left_hip"]) + motion.position(points["right_hip"])) / 2
    pelvis_to_hips = (rest[joint("left_hip")] + rest[joint("right_hip")]) / 2 - rest[0]
    root = hips * (our_leg / leg_length(motion)) - rotations[:, 0] @ pelvis_to_hips
    return root, rotations


def _turned(
    motion: SourceMotion, corrections: Corrections, name: str
) -> Float[np.ndarray, "frames 3 3"]:
    a, b, weight = motion.skeleton.drivers[name]
    R = motion.rotation(a) @ corrections[name]
    if weight == 0.0:
        return R
    towards = np.swapaxes(R, -1, -2) @ motion.rotation(b) @ corrections[name]
    part = Rotation.from_rotvec(Rotation.from_matrix(towards).as_rotvec() * weight)
    return R @ part.as_matrix()
