"""SMPL-X motion as AMASS keeps it: an npz of axis-angle poses, translation and shape.

Our joints are SMPL-X's by name, order and meaning, and an unturned joint is the T-pose in both. But our
T-pose holds arms and legs along the axes, SMPL-X's lets them hang and spread a little (some 5 to 20
degrees at shoulders and hips, different for each shape), and SMPL-X puts its pelvis at `trans` plus the
pelvis of its template. Both are only in the licensed model file: with it, poses and translation are
converted onto that body; without, rotations stand as they are and `trans` is the pelvis itself. The file
says which.
"""

import re
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from capture_app.exports.exported_take import Y_UP, Take
from omomo_core.body.model import BodyModel
from omomo_core.geometry.rotations import xyzw_from_matrix

_FACE = 9
"""Numbers of the jaw and the two eyes, between the body's and the hands'."""
_BODY = 22
_SHAPE = 16


def write_amass(path: Path, take: Take, smplx: BodyModel | None) -> None:
    """Write the arrays of an AMASS SMPL-X file, and the object beside them.

    `poses` (T, 165) axis-angle: root, 21 body joints, jaw and eyes (zero), 30 finger joints; also
    as `root_orient`, `pose_body`, `pose_jaw`, `pose_eye`, `pose_hand`. `trans` (T, 3), `betas` (16
    zeros), `gender`, `surface_model_type`, `mocap_frame_rate` and the older `mocap_framerate`.
    For robots' tools: `{object}_pos` and `{object}_quat` (w first), {object} being the mesh's name,
    `hand_contact` (T, 2) left and right, `foot_contact` (T, 4) ankles and toes.
    Of ours: `joints` (T, 52, 3) with `joint_names`, `object_position`, `object_rotation_xyzw`,
    `object_vertices`, `object_faces`, `exact`, `note`. World z up, metres.

    Args:
        path: the .npz file to write.
        take: in our own world; its skeleton has our 52 joints, at rest as SMPL-X's where `smplx`
            is given.
        smplx: the model that the take is on, if it is one.
    """
    T, pelvis = take.T_world_object, take.positions[:, take.human["pelvis"]]
    name = re.sub(r"\W+", "_", take.mesh.name) or "thing"
    rest = np.zeros(3) if smplx is None else smplx.rest_joints[0].double().numpy()
    arrays = _parts(_axis_angles(take)) | {
        "trans": pelvis - rest,
        "betas": np.zeros(_SHAPE),
        "gender": np.array("neutral"),
        "surface_model_type": np.array("smplx"),
        "mocap_frame_rate": np.array(take.fps),
        "mocap_framerate": np.array(take.fps),
        "joints": take.positions,
        "joint_names": np.array(take.skeleton.names),
        "object_position": T[:, :3, 3],
        "object_rotation_xyzw": xyzw_from_matrix(T[:, :3, :3]),
        f"{name}_pos": T[:, :3, 3],
        f"{name}_quat": np.roll(xyzw_from_matrix(T[:, :3, :3]), 1, axis=1),
        "hand_contact": take.hand_contact,
        "foot_contact": take.foot_contact,
        "object_vertices": take.mesh.vertices,
        "object_faces": take.mesh.faces,
        "exact": np.array(smplx is not None),
        "note": np.array(_note(smplx)),
    }
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def _axis_angles(take: Take) -> Float[np.ndarray, "frames 52 3"]:
    """Turns of the joints from rest, in the template's axes (y up), relative to their parents.

    The root's carries the template, which stands y up, into the world.
    """
    bones = take.skeleton
    R = take.rotations @ bones.rotations.swapaxes(-1, -2) @ Y_UP.T
    local = R[:, bones.above].swapaxes(-1, -2) @ R
    local[:, 0] = R[:, 0]
    vectors = Rotation.from_matrix(local.reshape(-1, 3, 3)).as_rotvec()
    return vectors.reshape(*local.shape[:2], 3)


def _parts(pose: Float[np.ndarray, "frames 52 3"]) -> dict[str, np.ndarray]:
    flat = pose.reshape(len(pose), -1)
    body, hands = flat[:, : 3 * _BODY], flat[:, 3 * _BODY :]
    face = np.zeros((len(pose), _FACE))
    return {
        "poses": np.concatenate([body, face, hands], axis=1),
        "root_orient": body[:, :3],
        "pose_body": body[:, 3:],
        "pose_jaw": face[:, :3],
        "pose_eye": face[:, 3:],
        "pose_hand": hands,
    }


def _note(smplx: BodyModel | None) -> str:
    if smplx is not None:
        return f"Poses and translation are those of {smplx.name} with betas 0."
    return (
        "Without the SMPL-X model: rotations are from a T-pose with arms and legs along the axes, and "
        "trans is the pelvis joint in the world. Posed on SMPL-X, arms and legs end some degrees off; "
        "export with ‹skeleton› SMPLX_NEUTRAL.npz for poses and translation of that body."
    )
