"""Recorded motion on our skeleton: frames of source joints calibrated, stretches to train on chosen.

Our joints are unrotated in a T-pose (y up, facing +z). A correction turns our frame into the
source's local frame, so that ``R_world_joint = R_world_source @ correction``. Limbs are matched by two
directions that every recording shows: the bone, and the axis about which the knee or elbow bends.
"""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import minimum_filter1d
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import joints_of, sole_points
from omomo_core.body.model import BodyModel
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import nearest_rotation, shortest_turn
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import Grounded, ground
from omomo_core.learning.recordings.mocap import SourceMotion, leg_length
from omomo_core.learning.recordings.quality import SIDES, elbow
from omomo_core.learning.recordings.smpl import RecordedMotion
from omomo_core.motion import FPS
from omomo_core.skeleton import BODY_JOINTS, joint

Corrections = dict[str, Float[np.ndarray, "3 3"]]
"""Our joint -> R_source_ours."""

_ENOUGH_BEND = 0.02
"""Mean sine of the bend below which a limb is too straight to show its hinge axis."""
_NEAR_REST = 0.5
"""Cosine to the hinge axis at rest: farther away, a bend is noise of a limb held straight."""
_LIMBS = {
    "hip": ("hip", "knee", "ankle"),
    "knee": ("hip", "knee", "ankle"),
    "shoulder": ("shoulder", "elbow", "wrist"),
    "elbow": ("shoulder", "elbow", "wrist"),
}


def calibrate(motions: Sequence[SourceMotion], body: BodyModel) -> Corrections:
    """Corrections of one source skeleton from all its recordings together.

    Args:
        motions: recordings on the same skeleton; a few seconds of walking are enough.
        body: whose rest bone directions the limbs are matched to.
    """
    skeleton = motions[0].skeleton
    if skeleton.rest_axes is None:
        corrections = _trunk(motions)
    else:
        corrections = dict.fromkeys(BODY_JOINTS, skeleton.rest_axes)
    for side in ("left", "right"):
        for part in _LIMBS:
            corrections[f"{side}_{part}"] = _limb(motions, body, side, part, corrections)
        if f"{side}_foot" in skeleton.points:
            for name in (f"{side}_ankle", f"{side}_foot"):
                corrections[name] = _foot(motions, name, side, corrections)
        if f"{side}_palm" in skeleton.points:
            corrections[f"{side}_wrist"] = _hand(motions, body, side, corrections)
        else:
            corrections[f"{side}_wrist"] = _following(
                motions, f"{side}_wrist", f"{side}_elbow", corrections
            )
    return corrections


def _trunk(motions: Sequence[SourceMotion]) -> Corrections:
    """Trunk and collars of a skeleton whose rest pose is unknown, from how it stands."""
    corrections: Corrections = {}
    for name, across in (("pelvis", "hip"), ("spine1", "hip"), ("spine2", "shoulder"),
                         ("spine3", "shoulder")):  # fmt: skip
        up = _mean_local(motions, name, [_Z * _upright(m)[:, None] for m in motions])
        left = _mean_local(motions, name, [_across(m, across) for m in motions])
        corrections[name] = _frame(left, up, order="xy") @ _frame(_X, _Y, order="xy").T
    for name in ("neck", "head", "left_collar", "right_collar"):
        corrections[name] = _following(motions, name, "spine3", corrections)
    return corrections


_X, _Y, _Z = np.eye(3)


def _limb(
    motions: Sequence[SourceMotion], body: BodyModel, side: str, part: str, now: Corrections
) -> Float[np.ndarray, "3 3"]:
    name, chain = f"{side}_{part}", [f"{side}_{p}" for p in _LIMBS[part]]
    lower = name == chain[1]
    a, b = (chain[1], chain[2]) if lower else (chain[0], chain[1])
    rest = body.rest_joints.double().numpy()
    our_bone = rest[joint(b)] - rest[joint(a)]
    our_hinge = _X if part in ("hip", "knee") else (-_Y if side == "left" else _Y)
    bone = _mean_local(motions, name, [_between(m, a, b) for m in motions])
    hinges = [_hinge(m, chain) for m in motions]
    bend = np.linalg.norm(np.concatenate(hinges), axis=-1).mean()
    hinge = _mean_local(motions, name, hinges)
    if name in now:
        extended = shortest_turn(now[name] @ our_bone, bone) @ now[name]
        if bend < _ENOUGH_BEND or (extended @ our_hinge) @ hinge < _NEAR_REST:
            return extended
    return _frame(bone, hinge, order="xy") @ _frame(our_bone, our_hinge, order="xy").T


def _hand(
    motions: Sequence[SourceMotion], body: BodyModel, side: str, now: Corrections
) -> Float[np.ndarray, "3 3"]:
    """The rest pose turned a little so that the hand points along ours."""
    name = f"{side}_wrist"
    rest = body.rest_joints.double().numpy()
    our_bone = rest[joint(f"{side}_middle1")] - rest[joint(name)]
    bone = _mean_local(motions, name, [_between(m, name, f"{side}_palm") for m in motions])
    return shortest_turn(now[name] @ our_bone, bone) @ now[name]


def _foot(
    motions: Sequence[SourceMotion], name: str, side: str, now: Corrections
) -> Float[np.ndarray, "3 3"]:
    """Soles are level while somebody stands on them, and feet point from ankle to toes."""
    planted = [_planted(m, side) & _upright(m) for m in motions]
    if name in now and not any(p.any() for p in planted):
        return now[name]
    up = _mean_local(motions, name, [_Z * p[:, None] for p in planted])
    forward = _mean_local(
        motions, name, [_between(m, f"{side}_ankle", f"{side}_foot") for m in motions]
    )
    return _frame(up, forward, order="yz") @ _frame(_Y, _Z, order="yz").T


def _following(
    motions: Sequence[SourceMotion], name: str, leader: str, now: Corrections
) -> Float[np.ndarray, "3 3"]:
    """The joint is turned like its leader on average."""
    total = np.zeros((3, 3))
    for m in motions:
        R_leader = m.rotation(m.skeleton.drivers[leader][0]) @ now[leader]
        R_source = m.rotation(m.skeleton.drivers[name][0])
        total += np.einsum("tji,tjk->ik", R_source, R_leader)
    return nearest_rotation(total)


def _mean_local(
    motions: Sequence[SourceMotion],
    name: str,
    directions: Sequence[Float[np.ndarray, "_ 3"]],
) -> Float[np.ndarray, " 3"]:
    """Mean of world vectors seen in the frame of the joint's driver, unit length."""
    total = np.zeros(3)
    for m, direction in zip(motions, directions, strict=True):
        R = m.rotation(m.skeleton.drivers[name][0])
        total += np.einsum("tji,tj->i", R, direction)
    return total / max(float(np.linalg.norm(total)), 1e-12)


def _between(m: SourceMotion, a: str, b: str) -> Float[np.ndarray, "frames 3"]:
    points = m.skeleton.points
    return m.position(points[b]) - m.position(points[a])


def _across(m: SourceMotion, part: str) -> Float[np.ndarray, "frames 3"]:
    return _between(m, f"right_{part}", f"left_{part}")


def _hinge(m: SourceMotion, chain: Sequence[str]) -> Float[np.ndarray, "frames 3"]:
    """Axis about which the limb is bent, as long as the sine of the bend."""
    upper, lower = _between(m, chain[0], chain[1]), _between(m, chain[1], chain[2])
    lengths = np.linalg.norm(upper, axis=-1) * np.linalg.norm(lower, axis=-1)
    return np.cross(upper, lower) / lengths[:, None]


def _upright(m: SourceMotion) -> Bool[np.ndarray, " frames"]:
    """Frames in which both legs are nearly straight under the hips: somebody stands or walks."""
    drop = [_between(m, f"{side}_ankle", f"{side}_hip")[:, 2] for side in ("left", "right")]
    return np.maximum(*drop) > 0.96 * leg_length(m)


def _planted(m: SourceMotion, side: str) -> Bool[np.ndarray, " frames"]:
    """Frames in which ankle and toes rest: both are slow for a quarter of a second."""
    still = np.ones(len(m.positions), bool)
    for part in ("ankle", "foot"):
        p = m.position(m.skeleton.points[f"{side}_{part}"])
        still &= np.linalg.norm(np.gradient(p, 1.0 / FPS, axis=0), axis=-1) < 0.15
    return minimum_filter1d(still.astype(np.uint8), 7) > 0


def _frame(
    first: Float[np.ndarray, " 3"], second: Float[np.ndarray, " 3"], *, order: str
) -> Float[np.ndarray, "3 3"]:
    """Rotation whose columns named by `order` are `first` and, as nearly as possible, `second`."""
    i, j = ("xyz".index(axis) for axis in order)
    k = 3 - i - j
    R = np.zeros((3, 3))
    R[:, i] = first / np.linalg.norm(first)
    perpendicular = second - R[:, i] * (R[:, i] @ second)
    R[:, j] = perpendicular / np.linalg.norm(perpendicular)
    R[:, k] = np.cross(R[:, i], R[:, j]) * (1.0 if (j - i) % 3 == 1 else -1.0)
    return R


SHORTEST = round(0.8 * FPS)
_STEP_HEIGHT = 0.09
"""The level stood on may differ this much from the clip's usual one, metres; more is climbing."""
_DEEPEST_SOLE = -0.08
_LOWEST_PELVIS = 0.22
_LOWEST_HEAD = 0.45
"""Metres; lower means lying, rolling or a handstand, which nobody does while carrying."""
WORST_SKATING = 0.3
_ELBOW = (-15.0, 165.0)
"""Degrees of bending: beyond, the recording is broken."""
_EDGE = round(0.1 * FPS)
"""Frames also dropped around a bad one."""


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
    return standing_clips(retargeted(motion, corrections, body), body, dropped)


def retargeted(motion: SourceMotion, corrections: Corrections, body: BodyModel) -> RecordedMotion:
    """A recording on our skeleton, with its name, source and licence."""
    root, rotations = retarget(motion, corrections, body)
    return RecordedMotion(motion.name, motion.skeleton.name, motion.licence, root, rotations)


def standing_clips(
    performance: RecordedMotion, body: BodyModel, dropped: Counter[str] | None = None
) -> Iterator[Clip]:
    """Yield clips as `mocap_clips` does, from motion that is already on our skeleton."""
    grounded = ground(body, performance.root, performance.rotations)
    reason = "skating" if grounded.skating > WORST_SKATING else "no-floor"
    stretches = [] if reason == "skating" else runs(usable_frames(body, grounded))
    stretches = [(a, b) for a, b in stretches if b - a >= SHORTEST]
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


def usable_frames(body: BodyModel, grounded: Grounded) -> Bool[np.ndarray, " frames"]:
    """Frames in which somebody stands or moves on one level floor, with sound elbows."""
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
    points = motion.skeleton.points
    hips = (motion.position(points["left_hip"]) + motion.position(points["right_hip"])) / 2
    pelvis_to_hips = (rest[joint("left_hip")] + rest[joint("right_hip")]) / 2 - rest[0]
    root = hips * leg_scale(motion, body) - rotations[:, 0] @ pelvis_to_hips
    return root, rotations


def leg_scale(motion: SourceMotion, body: BodyModel) -> float:
    """Length of our legs (thigh and shin) to that of the recording's."""
    rest = body.rest_joints.double().numpy()
    ours = sum(
        float(np.linalg.norm(rest[joint(f"left_{b}")] - rest[joint(f"left_{a}")]))
        for a, b in (("hip", "knee"), ("knee", "ankle"))
    )
    return ours / leg_length(motion)


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
