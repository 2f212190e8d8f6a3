"""Recorded clips: files, the object's mesh, and the person as a body of our kind.

A clip holds joint_names (22), joints (T,22,3), joint_rot_global_xyzw (T,22,4), palms (T,2,3; middle
knuckles, left then right), obj_pos (T,3), obj_rot_xyzw (T,4): 30 fps, z up, floor at 0, metres.
`meshes/<object>.npz` holds vertices and faces; a clip names its object, or its file name does
(subject_object_number).

A clip's rest pose has other axes (x forward, y left, z up) than ours, arms and legs that point elsewhere and
raised shoulders (`body.rest_turns`). With both taken out a rotation means to this skeleton what it means to
ours, and forward kinematics gives the clip's joints back. People who were recorded in shoes stand on their
soles.
"""

import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import MODEL_REST, TOES, Offsets, rest_turns
from omomo_core.body.model import BodyModel, with_height
from omomo_core.errors import InputError
from omomo_core.learning.evaluation.metrics import floor_height
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.skeleton import MODEL_ABOVE, MODEL_PARENTS, PALM_JOINTS, joint

AXES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""R_clip_ours at rest: our left, up and forward are the clip's y, z and x."""
THINNEST_SOLE, THICKEST_SOLE = -0.02, 0.06
"""Metres: what is beyond is a floor that was found wrongly, not shoes."""


def bone_offsets(
    joints: Float[np.ndarray, "frames 24 3"], rotations: Float[np.ndarray, "frames 22 3 3"]
) -> tuple[Offsets, float]:
    """Return each joint's offset in its parent's frame (median over the frames), and the farthest that
    any frame strays from it, metres, in the clip's axes: bones do not change their length.
    """
    parents = np.array(MODEL_PARENTS[1:])
    local = np.einsum(
        "fjyx,fjy->fjx", rotations[:, parents], joints[:, 1:] - joints[:, parents], optimize=True
    )
    offsets = np.zeros((24, 3))
    offsets[1:] = np.median(local, axis=0)
    return offsets, float(np.linalg.norm(local - offsets[1:], axis=-1).max())


def our_rotations(
    rotations: Float[np.ndarray, "frames 22 3 3"], offsets: Offsets, body: BodyModel
) -> Float[np.ndarray, "frames 22 3 3"]:
    """Rotations of a clip with the identity at our T-pose."""
    return rotations @ AXES @ rest_turns(body, offsets @ AXES)


def body_of(
    offsets: Offsets, body: BodyModel, joints: Float[np.ndarray, "frames 24 3"]
) -> BodyModel:
    """Return our body with the bones and shoes of a clip's person; its surface follows the joints.

    Args:
        offsets: of the person's bones, in the clip's axes.
        body: whose surface the person gets.
        joints: of the clip, world, metres. They show how high toes stand above the floor.
    """
    theirs = offsets @ AXES
    bones = np.einsum("jyx,jy->jx", rest_turns(body, theirs)[list(MODEL_ABOVE)], theirs)
    rest = np.zeros((24, 3))
    for j in range(1, 24):
        rest[j] = rest[MODEL_PARENTS[j]] + bones[j]
    ours = body.rest_joints.double().numpy()
    scaled = with_height(body, body.height * _best_scale(rest, ours[list(MODEL_REST)]))
    bare = _all_joints(rest, scaled.rest_joints.double().numpy())
    floor = float(scaled.vertices[:, 1].min())
    sole = _shoe_sole(float(bare[list(TOES), 1].mean()) - floor, floor_height(joints))
    moved = torch.from_numpy(bare + np.array([0.0, sole, 0.0])).float()
    return replace(
        scaled,
        name=f"{body.name} with a recorded person's bones",
        rest_joints=moved,
        vertices=scaled.vertices + _follow(scaled, moved - scaled.rest_joints),
        shoe_sole=sole,
    )


def _shoe_sole(bare: float, standing: float) -> float:
    """Return how thick soles are, metres, from how high toe joints are on bare feet and as recorded.

    Args:
        bare: height of toe joints above the floor, metres.
        standing: the same of the recorded ones that stand; 0 if none do, and bare feet are taken.
    """
    return float(np.clip(standing - bare, THINNEST_SOLE, THICKEST_SOLE)) if standing else 0.0


def _best_scale(theirs: Float[np.ndarray, "24 3"], ours: Float[np.ndarray, "24 3"]) -> float:
    """Least squares over the joints of the T-pose, measured from between the ankles."""
    a, b = (x - x[[7, 8]].mean(axis=0) for x in (ours, theirs))
    return float((a * b).sum() / (a * a).sum())


def _all_joints(
    rest: Float[np.ndarray, "24 3"], ours: Float[np.ndarray, "52 3"]
) -> Float[np.ndarray, "52 3"]:
    """Fingers keep our hand's shape about the person's palm; the ankles are as high as ours."""
    up = np.array([0.0, ours[[7, 8], 1].mean() - rest[[7, 8], 1].mean(), 0.0])
    shifts = [rest[22 + side] - ours[palm] for side, palm in enumerate(PALM_JOINTS)]
    return np.concatenate([rest[:22], ours[22:37] + shifts[0], ours[37:] + shifts[1]]) + up


def _follow(body: BodyModel, moves: Float[torch.Tensor, "52 3"]) -> Float[torch.Tensor, "verts 3"]:
    """Return how the surface moves with the joints.

    The head follows the neck, so that its size stays. What is on the floor stays on it: feet are stretched
    below their toe joints.
    """
    moves = moves.clone()
    moves[joint("head")] = moves[joint("neck")]
    moved = (body.skin_weights[..., None] * moves[body.skin_joints]).sum(dim=1)
    height = body.vertices[:, 1] - body.vertices[:, 1].min()
    toes = body.rest_joints[list(TOES), 1].mean() - body.vertices[:, 1].min()
    moved[:, 1] *= (height / toes).clamp(max=1.0)
    return moved


NAMES = (
    *("Pelvis", "L_Hip", "R_Hip", "Torso", "L_Knee", "R_Knee", "Spine", "L_Ankle", "R_Ankle"),
    *("Chest", "L_Toe", "R_Toe", "Neck", "L_Thorax", "R_Thorax", "Head", "L_Shoulder"),
    *("R_Shoulder", "L_Elbow", "R_Elbow", "L_Wrist", "R_Wrist"),
)
"""The clips' names of our 22 body joints, in our order."""
ARRAYS = {
    "joints": (22, 3),
    "joint_rot_global_xyzw": (22, 4),
    "palms": (2, 3),
    "obj_pos": (3,),
    "obj_rot_xyzw": (4,),
}
SHORTEST = 4
"""Frames: speeds and jerks of fewer mean nothing."""
RIGID = 0.01
"""Metres that a bone's end may stray in its parent's frame."""
_UNREADABLE = (OSError, ValueError, EOFError, KeyError, TypeError, zipfile.BadZipFile, zlib.error)


@dataclass(frozen=True)
class RealClip:
    """A recorded person who moves an object."""

    name: str
    text: str
    """What they were asked to do, "" if the clip does not say."""
    motion: ObjectMotion
    root: Float[np.ndarray, "frames 3"]
    rotations: Float[np.ndarray, "frames 22 3 3"]
    """Global, the identity is our T-pose."""
    joints: Float[np.ndarray, "frames 24 3"]
    """22 body joints and two palms, world, metres."""
    body: BodyModel
    """Our body with this person's bones."""


def clip_paths(folder: Path) -> list[Path]:
    """The clips in a folder, by name.

    Raises:
        InputError: the folder is missing or has no npz file.
    """
    paths = sorted(folder.glob("*.npz")) if folder.is_dir() else []
    if not paths:
        raise InputError(
            "no-clips",
            "There are no clips (npz files) in this folder.",
            where=str(folder),
            fix="Give the folder with the clips; see docs/evaluation.md for their layout.",
        )
    return paths


def read_clip(path: Path, body: BodyModel) -> RealClip:
    """Read and check one clip.

    Args:
        path: the npz file.
        body: whose rotations and surface the person is given.

    Raises:
        InputError: unreadable, arrays missing or of other shapes or lengths, no frames, not finite,
            not metres, another skeleton, bones that stretch, not 30 fps or z up, or no mesh.
    """
    data = _read(path)
    joints, rotations = _person(data, path)
    T = np.tile(np.eye(4), (len(joints), 1, 1))
    T[:, :3, :3] = _matrices(data["obj_rot_xyzw"], path)
    T[:, :3, 3] = data["obj_pos"]
    name = str(data["object"]) if "object" in data else _object_of(path)
    motion = ObjectMotion(_mesh(path.parent / "meshes", name), T, np.ones(len(T), bool))
    _check_metres(motion, joints, path)
    offsets, stray = bone_offsets(joints, rotations)
    if stray > RIGID:
        raise _bad("clip-bones", _why_bones_stray(joints, rotations, offsets), path, "skeleton")
    return RealClip(
        name=path.stem,
        text=str(data["text"]) if "text" in data else "",
        motion=motion,
        root=joints[:, 0],
        rotations=our_rotations(rotations, offsets, body),
        joints=joints,
        body=body_of(offsets, body, joints),
    )


def _why_bones_stray(
    joints: Float[np.ndarray, "frames 24 3"],
    rotations: Float[np.ndarray, "frames 22 3 3"],
    offsets: Float[np.ndarray, "24 3"],
) -> str:
    """Return where joints and rotations disagree most, and whether a length or a rotation is to blame."""
    parents = np.array(MODEL_PARENTS[1:])
    bones = joints[:, 1:] - joints[:, parents]
    turned = np.einsum("fjxy,jy->fjx", rotations[:, parents], offsets[1:])
    off = np.linalg.norm(bones - turned, axis=-1)
    frame, bone = np.unravel_index(int(off.argmax()), off.shape)
    length = abs(np.linalg.norm(bones[frame, bone]) - np.linalg.norm(offsets[1 + bone]))
    named = (*NAMES, "the left palm", "the right palm")
    joint, parent = named[1 + bone], named[parents[bone]]
    if length > RIGID:
        return f"The bone to {joint} is {100 * length:.0f} cm longer or shorter in frame {frame}."
    return (
        f"Joints and rotations disagree: in frame {frame} {joint} is {100 * off.max():.0f} cm from where "
        f"the rotation of {parent} puts it, though the bone keeps its length."
    )


def _read(path: Path) -> dict[str, np.ndarray]:
    try:
        data = _arrays(path)
    except _UNREADABLE as error:
        raise InputError(
            "clip-unreadable",
            "The clip cannot be read.",
            where=str(path),
            fix="Copy the file again; object arrays are not read.",
        ) from error
    missing = [key for key in ("joint_names", *ARRAYS) if key not in data]
    if missing:
        raise _bad("clip-keys", f"It has no {', '.join(missing)}.", path, "layout")
    frames = len(data["joints"]) if data["joints"].ndim else 0
    if frames < SHORTEST:
        raise _bad("clip-empty", f"It has {frames} frames.", path, "length")
    for key, shape in ARRAYS.items():
        if data[key].shape != (frames, *shape) or data[key].dtype.kind not in "fiu":
            found = f"{key} is {data[key].shape}, not {(frames, *shape)}"
            raise _bad("clip-shape", f"Its arrays do not fit: {found}.", path, "layout")
        data[key] = data[key].astype(np.float64)
        if not np.isfinite(data[key]).all():
            raise _bad("clip-not-finite", f"{key} is not finite everywhere.", path, "values")
    if float(data.get("fps", np.float64(30))) != 30 or str(data.get("up", "z")) != "z":
        raise _bad("clip-convention", "It is not 30 fps with z up.", path, "convention")
    return data


def _arrays(path: Path) -> dict[str, np.ndarray]:
    # Opened here, because numpy leaves a file open that turns out to be no archive.
    with path.open("rb") as handle, np.load(handle, allow_pickle=False) as file:
        return {key: file[key] for key in file.files}


def _person(
    data: Mapping[str, np.ndarray], path: Path
) -> tuple[Float[np.ndarray, "frames 24 3"], Float[np.ndarray, "frames 22 3 3"]]:
    """Joints and rotations in our order."""
    names = [str(name) for name in data["joint_names"]]
    if sorted(names) != sorted(NAMES):
        unknown = sorted(set(names) ^ set(NAMES))
        raise _bad("clip-skeleton", f"It has other joints: {', '.join(unknown)}.", path, "skeleton")
    order = [names.index(name) for name in NAMES]
    joints = np.concatenate([data["joints"][:, order], data["palms"]], axis=1)
    return joints, _matrices(data["joint_rot_global_xyzw"][:, order], path)


def _matrices(xyzw: Float[np.ndarray, "*b 4"], path: Path) -> Float[np.ndarray, "*b 3 3"]:
    if np.abs(np.linalg.norm(xyzw, axis=-1) - 1).max() > 0.01:
        raise _bad("clip-rotations", "Quaternions are not of unit length.", path, "values")
    flat = Rotation.from_quat(xyzw.reshape(-1, 4)).as_matrix()
    return flat.reshape(*xyzw.shape[:-1], 3, 3)


def _object_of(path: Path) -> str:
    parts = path.stem.split("_")
    return "_".join(parts[1:-1]) if len(parts) > 2 else path.stem


def _mesh(folder: Path, name: str) -> ObjectMesh:
    path = folder / f"{name}.npz"
    try:
        file = _arrays(path)
        vertices, faces = file["vertices"].astype(np.float64), file["faces"].astype(np.int64)
    except _UNREADABLE as error:
        raise InputError(
            "clip-mesh",
            f"The mesh of the object {name!r} is missing or cannot be read.",
            where=str(path),
            fix="Put vertices and faces of the object into that file.",
        ) from error
    fits = vertices.ndim == faces.ndim == 2 and vertices.shape[1] == faces.shape[1] == 3
    if not fits or not len(faces) or not np.isfinite(vertices).all():
        raise _bad("clip-mesh", "The mesh is empty or damaged.", path, "layout")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise _bad("clip-mesh", "Faces name vertices that are not there.", path, "layout")
    return ObjectMesh(vertices, faces, name)


def _check_metres(
    motion: ObjectMotion, joints: Float[np.ndarray, "frames 24 3"], path: Path
) -> None:
    """People are 1 to 2.5 m from head to toe along their bones, objects 2 cm to 5 m."""
    leg = np.linalg.norm(joints[:, 4] - joints[:, 1], axis=-1).mean()
    size = float(np.ptp(motion.mesh.vertices, axis=0).max())
    if not 0.2 < leg < 0.7:
        raise _bad("clip-units", f"A thigh of {leg:.3g} m: not metres.", path, "units")
    if not 0.02 < size < 5:
        raise _bad("clip-units", f"An object of {size:.3g} m: not metres.", path, "units")
    if np.abs(joints[..., 2]).max() > 5:
        raise _bad("clip-units", "The person is not on the floor at z = 0.", path, "convention")


def _bad(code: str, what: str, path: Path, concern: str) -> InputError:
    fixes = {
        "layout": "Write the arrays that docs/evaluation.md lists.",
        "length": "Leave the file out.",
        "values": "Repair or leave out the frames concerned.",
        "convention": "Convert the clip to 30 fps, z up, floor at 0.",
        "skeleton": "Retarget the clip to the joints that docs/evaluation.md lists.",
        "units": "Convert the clip and its mesh to metres.",
    }
    return InputError(code, what, where=str(path), fix=fixes[concern])
