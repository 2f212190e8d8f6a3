"""The OMOMO release's processed files: people with the objects they moved, on our skeleton.

The release's person is brought to our body's size with the whole scene: way, object and palms are
scaled by the length of the legs. Our arms are then solved to the release's palms, so that hands stay
where they were on the object.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from scipy.ndimage import binary_closing, binary_opening

from omomo_core.body.limbs import reach
from omomo_core.body.model import BodyModel
from omomo_core.data.clips import Clip
from omomo_core.data.grounding import ground
from omomo_core.data.joblib_file import read_joblib
from omomo_core.data.mocap import check_legs
from omomo_core.data.release_objects import ReleaseObjects
from omomo_core.data.smpl import world_rotations
from omomo_core.errors import InputError
from omomo_core.geometry.surface import sample_surface
from omomo_core.motion import ObjectMotion
from omomo_core.skeleton import MODEL_PARENTS, joint

LICENCE = "OMOMO data (github.com/lijiaman/omomo_release): its authors state no licence"
MESHES = "captured_objects"
_SHAPES: dict[str, tuple[int, ...]] = {
    "trans": (3,),
    "root_orient": (3,),
    "pose_body": (63,),
    "obj_trans": (3,),
    "obj_rot": (3, 3),
    "obj_scale": (),
}
"""Of the channels of a sequence, after the frames."""
_TOUCHING = 0.05
"""Metres between palm joint and surface: the paper's rule."""
_SHORTEST = 24
_SIDES = ("left", "right")
_LIMBS = tuple(
    (f"{side}_{a}", f"{side}_{b}")
    for side in _SIDES
    for a, b in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))
)


def release_clips(path: Path, body: BodyModel) -> Iterator[Clip | InputError]:
    """Every sequence of a release file, or what is wrong with it.

    Args:
        path: `train_diffusion_manip_seq_joints24.p` or the like; the release's folder
            ``captured_objects`` stands beside it or one folder up.
        body: whose proportions the clips get.

    Raises:
        InputError: as `read_joblib`; ``release-format`` when the file holds no sequences;
            ``release-meshes`` when the folder of objects is not there.
    """
    sequences = read_joblib(path)
    if not isinstance(sequences, dict) or not all(
        isinstance(s, dict) and "seq_name" in s for s in sequences.values()
    ):
        raise InputError(
            "release-format",
            "These are not the release's processed sequences.",
            where=str(path),
            fix="Give train_diffusion_manip_seq_joints24.p.",
        )
    folder = next((p / MESHES for p in path.absolute().parents[:2] if (p / MESHES).is_dir()), None)
    if folder is None:
        raise InputError(
            "release-meshes",
            f"The release's folder {MESHES} is not beside the file.",
            where=str(path),
            fix="Keep the release's folders together.",
        )
    objects = ReleaseObjects(folder)
    for sequence in sequences.values():
        try:
            yield _clip(sequence, objects, body, f"{path}, {sequence['seq_name']}")
        except InputError as problem:
            yield problem


def _clip(
    sequence: Mapping[str, Any], objects: ReleaseObjects, body: BodyModel, where: str
) -> Clip:
    data = _channels(sequence, where)
    bones = _rest_offsets(sequence, where)
    ours = body.rest_joints.double().numpy()
    scale = _leg(_bones(ours)) / _leg(bones)
    R_theirs = world_rotations(
        np.concatenate([data["root_orient"], data["pose_body"]], axis=1).reshape(-1, 22, 3)
    )
    pelvis = data["trans"] - np.asarray(sequence["trans2joint"], float).reshape(3)
    theirs = _joints(pelvis, R_theirs, bones) * scale
    R = _redirected(R_theirs, bones, _bones(ours))
    hips = [joint("left_hip"), joint("right_hip")]
    root = theirs[:, hips].mean(axis=1) - R[:, 0] @ (ours[hips].mean(axis=0) - ours[0])
    grounded = ground(body, root, R)
    rotations = torch.from_numpy(grounded.rotations)
    for side, limb in enumerate(("left_arm", "right_arm")):
        goal = torch.from_numpy(theirs[:, 22 + side])
        rotations, _ = reach(body, torch.from_numpy(grounded.root), rotations, limb, goal)
    T = np.tile(np.eye(4), (len(pelvis), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = data["obj_rot"], data["obj_trans"] * scale
    mesh = objects.mesh(sequence, scale, where)
    moved = ObjectMotion(mesh, T, np.ones(len(T), bool))
    return Clip(
        name=str(sequence["seq_name"]),
        source="omomo",
        licence=LICENCE,
        root=grounded.root,
        rotations=rotations.numpy(),
        hand_contact=_touching(theirs[:, 22:], moved, _TOUCHING * scale),
        foot_contact=grounded.foot_contact,
        object_motion=moved,
    )


def _channels(sequence: Mapping[str, Any], where: str) -> dict[str, np.ndarray]:
    """The channels of a sequence, as many frames of each.

    Raises:
        InputError: ``release-format``, ``mocap-not-finite``, ``mocap-empty``.
    """
    data: dict[str, np.ndarray] = {}
    for key, shape in _SHAPES.items():
        try:
            found = np.asarray(sequence[key], float)
            data[key] = found.reshape(len(found), *shape)
        except (KeyError, TypeError, ValueError) as problem:
            raise InputError("release-format", f"'{key}' is missing or odd.", where=where) from (
                problem
            )
        if len(data[key]) != len(data["trans"]):
            raise InputError("release-format", f"'{key}' has another length.", where=where)
        bad = ~np.isfinite(data[key]).reshape(len(found), -1).all(axis=1)
        if bad.any():
            frame = int(bad.argmax())
            raise InputError("mocap-not-finite", f"'{key}', frame {frame}, is NaN.", where=where)
    if len(data["trans"]) < _SHORTEST:
        raise InputError("mocap-empty", "The sequence is shorter than 0.8 s.", where=where)
    return data


def _rest_offsets(sequence: Mapping[str, Any], where: str) -> Float[np.ndarray, "24 3"]:
    """Offsets from the parents; the root's own row means nothing."""
    try:
        bones = np.asarray(sequence["rest_offsets"], float).reshape(24, 3)
        origin = np.asarray(sequence["trans2joint"], float).reshape(3)
    except (KeyError, TypeError, ValueError) as problem:
        raise InputError("release-format", "The rest pose is missing.", where=where) from problem
    if not (np.isfinite(bones[1:]).all() and np.isfinite(origin).all()):
        raise InputError("mocap-not-finite", "The rest pose is NaN.", where=where)
    check_legs(_leg(bones), where)
    return bones


def _bones(rest: Float[np.ndarray, "joints 3"]) -> Float[np.ndarray, "24 3"]:
    """Offsets of our 24 model joints from their parents."""
    palms = [joint("left_middle1"), joint("right_middle1")]
    at = np.concatenate([rest[:22], rest[palms]])
    return at - at[[max(p, 0) for p in MODEL_PARENTS]]


def _leg(bones: Float[np.ndarray, "24 3"]) -> float:
    names = [f"{side}_{part}" for side in _SIDES for part in ("knee", "ankle")]
    return float(np.linalg.norm(bones[[joint(n) for n in names]], axis=-1).sum()) / 2


def _joints(
    pelvis: Float[np.ndarray, "frames 3"],
    R: Float[np.ndarray, "frames 22 3 3"],
    bones: Float[np.ndarray, "24 3"],
) -> Float[np.ndarray, "frames 24 3"]:
    joints = [pelvis]
    for j in range(1, 24):
        parent = MODEL_PARENTS[j]
        joints.append(joints[parent] + R[:, parent] @ bones[j])
    return np.stack(joints, axis=1)


def _redirected(
    R: Float[np.ndarray, "frames 22 3 3"],
    theirs: Float[np.ndarray, "24 3"],
    ours: Float[np.ndarray, "24 3"],
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Our limbs point as theirs do, though the two bodies' rest poses are not quite the same."""
    out = R.copy()
    for a, b in _LIMBS:
        u, v = (x[joint(b)] / np.linalg.norm(x[joint(b)]) for x in (ours, theirs))
        axis, cosine = np.cross(u, v), float(u @ v)
        K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        out[:, joint(a)] = R[:, joint(a)] @ (np.eye(3) + K + K @ K / (1 + cosine))
    return out


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
