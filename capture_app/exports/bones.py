"""Our skeleton and skin under the names that other programs give the joints."""

from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float, Int

from capture_app.blender_extension.bone_names import BoneNames
from capture_app.exports.contact_spans import contact_spans
from capture_app.exports.exported_take import Y_UP, Skeleton, Skin, Take, pose
from capture_app.exports.resample import Sampled
from omomo_core.body.kinematics import full_kinematics, vertex_normals
from omomo_core.body.model import BodyModel
from omomo_core.geometry.rotations import matrix_from_xyzw, xyzw_from_matrix
from omomo_core.geometry.surface import SplitSurface, split_creases
from omomo_core.motion import ObjectMesh
from omomo_core.skeleton import ALL_JOINTS, ALL_PARENTS


def take_on_own_bones(sampled: Sampled, body: BodyModel, names: BoneNames) -> Take:
    """A motion as it is: our 52 joints, and a root on the floor if the names have one.

    Args:
        sampled: the motion at the rate to be written.
        body: its bones must be those that the motion moves.
        names: what to call them.
    """
    human, moved = sampled.human, sampled.object_motion
    skeleton = _skeleton(body, names)
    ours = global_rotations(sampled, body)
    still = np.tile(Y_UP.T, (len(ours), skeleton.hips, 1, 1))
    R = np.concatenate([still, ours], axis=1)
    first = skeleton.hips
    return Take(
        fps=sampled.fps,
        skeleton=skeleton,
        skin=skin_of(body, np.arange(len(ALL_JOINTS)) + first, standing_shift(body)),
        body=body.name,
        credit=body.credit,
        positions=pose(skeleton, human.root.astype(np.float64), R),
        rotations=R,
        mesh=moved.mesh,
        T_world_object=moved.T_world_object,
        hand_contact=human.hand_contact > 0.5,
        foot_contact=human.foot_contact > 0.5,
        spans=contact_spans(sampled),
        human={name: j + first for j, name in enumerate(ALL_JOINTS)},
    )


def global_rotations(sampled: Sampled, body: BodyModel) -> Float[np.ndarray, "frames 52 3 3"]:
    """R_world_joint of every joint, orthonormal in double precision."""
    human = sampled.human
    parts = (torch.from_numpy(x).double() for x in (human.root, human.rotations, human.fingers))
    R = full_kinematics(body, *parts)[1].numpy()
    return matrix_from_xyzw(xyzw_from_matrix(R))


def skin_of(body: BodyModel, index: Int[np.ndarray, "52"], shift: Float[np.ndarray, "3"]) -> Skin:
    """A body's surface at rest in the world.

    Args:
        body: in the pose in which the bones rest, y up.
        index: joint of the skeleton for each of our joints.
        shift: added to the points, y up, metres.
    """
    joints, weights = strongest_influences(body)
    normals = vertex_normals(body.vertices, body.faces).double().numpy()
    return Skin(
        vertices=(body.vertices.double().numpy() + shift) @ Y_UP,
        normals=unit_normals(normals) @ Y_UP,
        faces=body.faces.numpy(),
        joints=np.where(weights > 0, index[joints], 0),
        weights=weights,
    )


def standing_shift(body: BodyModel) -> Float[np.ndarray, "3"]:
    """Return the shift that puts a rest pose (y up) with its pelvis over the origin, soles on the floor."""
    pelvis = body.rest_joints[0].double().numpy()
    return -np.array([pelvis[0], float(body.vertices[:, 1].min()), pelvis[2]])


def strongest_influences(
    body: BodyModel, count: int = 4
) -> tuple[Int[np.ndarray, "verts count"], Float[np.ndarray, "verts count"]]:
    """The joints that move each vertex most, and their weights summing to 1.

    Four, because readers need not support more. Unused places hold joint 0 with weight 0.
    """
    weights = torch.zeros(len(body.vertices), len(ALL_JOINTS))
    weights.scatter_add_(1, body.skin_joints.long(), body.skin_weights.float())
    kept, joints = weights.topk(count, dim=1)
    kept = kept / kept.sum(dim=1, keepdim=True)
    return torch.where(kept > 0, joints, 0).numpy(), kept.numpy()


def unit_normals(normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """Unit length as float32 keeps it; a normal that is nothing (a collapsed face) points up (y)."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 1e-6, normals / np.maximum(length, 1e-6), [0.0, 1.0, 0.0])


def _skeleton(body: BodyModel, names: BoneNames) -> Skeleton:
    points = (body.rest_joints.double().numpy() + standing_shift(body)) @ Y_UP
    bones, parents = tuple(names.of[name] for name in ALL_JOINTS), ALL_PARENTS
    if names.root is not None:
        points = np.concatenate([np.zeros((1, 3)), points])
        bones, parents = (names.root, *bones), (-1, *(p + 1 for p in parents))
    standing = np.tile(Y_UP.T, (len(bones), 1, 1))
    return Skeleton(bones, parents, points, standing, hips=len(bones) - len(ALL_JOINTS))


_CREASE = np.radians(30.0)
"""Neighbouring faces that meet at a sharper angle than this keep a hard edge."""


def creased(mesh: ObjectMesh) -> SplitSurface:
    """The surface with its vertices doubled along hard edges and seams, and unit normals."""
    uv = None if mesh.texture is None else mesh.texture.uv
    split = split_creases(mesh.vertices, mesh.faces, _CREASE, uv)
    return replace(split, normals=unit_normals(split.normals))
