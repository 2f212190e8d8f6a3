"""Motion in SMPL's terms on our skeleton, and people on SMPL-X's skeleton with their own bones.

Our body joints are SMPL-X's and unrotated in the same T-pose, so rotations carry over as they are. What
a file lacks without its body, the length of the legs, shows in the stride: while a foot stands, the
pelvis travels over it by as much as the leg swings. By how much that T-pose raises the shoulders only the
body tells (`body.rest_turns`): ours end some centimetres lower.

The person is brought to our body's size with the whole scene: way, object and palms are scaled by the
length of the legs. Our arms are then solved to the person's palms, so that hands stay where they were on
the object.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import binary_closing, binary_opening
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import global_rotations, rest_offsets, rest_turns, sole_points
from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.geometry.surface import sample_surface
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import ground
from omomo_core.learning.recordings.mocap import UNREADABLE, check_rate, not_a_motion, resample
from omomo_core.motion import FPS, ObjectMotion
from omomo_core.skeleton import MODEL_PARENTS, joint

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


_TOUCHING = 0.05
"""Metres between palm joint and surface: the paper's rule."""


@dataclass(frozen=True)
class SmplPerson:
    """How a person with bones of their own moves; world z up, floor 0, metres, 30 fps."""

    pelvis: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    """Global, the identity is SMPL-X's rest pose (x left, y up, z forward)."""
    bones: Float[np.ndarray, "24 3"]
    """From each joint's parent to it at rest; the root's own row means nothing."""

    def joints(self) -> Float[np.ndarray, "frames 24 3"]:
        """The 22 body joints and two palms, world, metres."""
        joints = [self.pelvis]
        for j in range(1, 24):
            parent = MODEL_PARENTS[j]
            joints.append(joints[parent] + self.rotations[:, parent] @ self.bones[j])
        return np.stack(joints, axis=1)


@dataclass(frozen=True)
class ClipOrigin:
    """What a clip says of itself."""

    name: str
    source: str
    licence: str


def leg(bones: Float[np.ndarray, "24 3"]) -> float:
    """Length of thigh and shin, mean of both sides."""
    names = [f"{side}_{part}" for side in ("left", "right") for part in ("knee", "ankle")]
    return float(np.linalg.norm(bones[[joint(n) for n in names]], axis=-1).sum()) / 2


def size_of(person: SmplPerson, body: BodyModel) -> float:
    """How many times as large the person's scene must become for our legs."""
    return leg(rest_offsets(body)) / leg(person.bones)


def person_root(
    person: SmplPerson, body: BodyModel
) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Root and global rotations of our body, at the scene's new size and not yet on the floor."""
    ours = body.rest_joints.double().numpy()
    theirs = person.joints() * size_of(person, body)
    R = person.rotations @ rest_turns(body, person.bones)
    hips = [joint("left_hip"), joint("right_hip")]
    root = theirs[:, hips].mean(axis=1) - R[:, 0] @ (ours[hips].mean(axis=0) - ours[0])
    return root, R


def person_clip(
    person: SmplPerson, moved: ObjectMotion, origin: ClipOrigin, body: BodyModel
) -> Clip:
    """A person and the object they hold on our body.

    Args:
        person: at their own size.
        moved: the object, `size_of` the person times as large as it was.
        origin: name, source and licence of the clip.
        body: whose proportions the clip gets.
    """
    scale = size_of(person, body)
    palms = person.joints()[:, 22:] * scale
    root, R = person_root(person, body)
    grounded = ground(body, root, R)
    rotations = torch.from_numpy(grounded.rotations)
    for side, limb in enumerate(("left_arm", "right_arm")):
        goal = torch.from_numpy(palms[:, side])
        rotations, _ = reach(body, torch.from_numpy(grounded.root), rotations, limb, goal)
    return Clip(
        name=origin.name,
        source=origin.source,
        licence=origin.licence,
        root=grounded.root,
        rotations=rotations.numpy(),
        hand_contact=_touching(palms, moved, _TOUCHING * scale),
        foot_contact=grounded.foot_contact,
        object_motion=moved,
    )


def _touching(
    palms: Float[np.ndarray, "frames 2 3"], moved: ObjectMotion, near: float
) -> Float[np.ndarray, "frames 2"]:
    """1 where a palm is nearer to the surface than `near`, without flicker."""
    T = moved.T_world_object
    local = np.einsum("tji,tkj->tki", T[:, :3, :3], palms - T[:, None, :3, 3])
    distance, _ = sample_surface(moved.mesh).tree.query(local.reshape(-1, 3))
    column = np.ones((5, 1), bool)
    touching = distance.reshape(-1, 2) < near
    return binary_opening(binary_closing(touching, column), column).astype(float)
