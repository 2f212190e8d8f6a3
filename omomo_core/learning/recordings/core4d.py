"""CORE4D (Liu et al. 2024, CC BY 4.0): two people who move a chair, desk, box, board, barrel or stick.

The layout is that of the file definitions in github.com/leolyliu/CORE4D-Instructions. A take is a
folder with ``person1_poses.npz`` and ``person2_poses.npz`` (a pickled dict of SMPL-X parameters and of the
127 joints they give), ``smooth_objposes.npy`` or ``object_poses_<name>.npy`` (T, 4, 4) and
``object_metadata.json``; meshes are ``object_models/<kind>/<name>_m.obj`` beside the folder of motions. The
world is y up, in metres, at the 15 frames a second of the cameras that frames are aligned to.

No licensed body is needed: bones are the joints seen in their parents' frames. Each person becomes clips of
their own, of the frames in which the object rests or one of this person's palms touches it. While the other
one alone moves it, it would seem to move by itself.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import trimesh
from jaxtyping import Bool, Float
from scipy.ndimage import binary_closing

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.geometry.runs import runs
from omomo_core.geometry.transforms import nearest_rotation, turning_speed
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.grounding import ground
from omomo_core.learning.recordings.joblib_file import read_pickled_array
from omomo_core.learning.recordings.mocap import R_ZUP, check_legs, resample
from omomo_core.learning.recordings.object_recordings import LEAST_CONTACT
from omomo_core.learning.recordings.omomo_release import thinned
from omomo_core.learning.recordings.retargeting import SHORTEST
from omomo_core.learning.recordings.smpl import (
    ClipOrigin,
    SmplPerson,
    leg,
    person_clip,
    person_root,
    size_of,
    world_rotations,
)
from omomo_core.motion import FPS, ObjectMesh, ObjectMotion
from omomo_core.skeleton import MODEL_PARENTS

LICENCE = "CC BY 4.0 (CORE4D, Liu et al. 2024, github.com/leolyliu/CORE4D-Instructions)"
_PEOPLE = ("person1_poses.npz", "person2_poses.npz")
_RATE = 15.0
_PALMS = (28, 43)
"""The bases of the middle fingers among SMPL-X's joints."""
_SHAPES: dict[str, tuple[int, ...]] = {
    "global_orient": (3,),
    "body_pose": (21, 3),
    "joints": (127, 3),
}
_RESTING, _NOT_TURNING = 0.1, 0.3
"""An object slower than this, metres and radians per second, is at rest."""
_BRIDGED = 3
"""Frames to both sides for which a hand may be seen off an object that moves."""


def is_core4d(path: Path) -> bool:
    """Whether a file is a person of a CORE4D take: by its name and the object's poses beside it."""
    return path.name in _PEOPLE and _object_poses(path.parent) is not None


def core4d_clips(path: Path, body: BodyModel) -> Iterator[Clip]:
    """Yield what one person of a take does with the object.

    Args:
        path: ``person1_poses.npz`` or ``person2_poses.npz``.
        body: whose proportions the clips get.

    Raises:
        InputError: as `read_pickled_array`; ``core4d-format`` when an array is missing or odd,
            ``core4d-mesh``, ``mocap-not-finite``, ``mocap-empty``, ``mocap-units``; ``no-contact``
            when no stretch of 0.8 s shows a hand on the object.
    """
    person, T = _read(path)
    mesh = _mesh(path)
    scale = size_of(person, body)
    level = float(np.median(ground(body, *person_root(person, body)).level)) / scale
    person = replace(person, pelvis=person.pelvis - [0.0, 0.0, level])
    T[:, :3, 3] = (T[:, :3, 3] - [0.0, 0.0, level]) * scale
    sized = ObjectMesh((mesh.vertices * scale).astype(np.float32), mesh.faces, mesh.name)
    moved = ObjectMotion(sized, T, np.ones(len(T), bool))
    take = f"{path.parent.parent.name}_{path.parent.name}_{path.name.partition('_')[0]}_{mesh.name}"
    clip = person_clip(person, moved, ClipOrigin(take, "core4d", LICENCE), body)
    stretches = _stretches(clip)
    if not stretches:
        what = "This person's hands do not move the object for 0.8 s."
        raise InputError("no-contact", what, where=str(path))
    for k, part in enumerate(stretches):
        yield _part(clip, part, take if len(stretches) == 1 else f"{take}#{k}")


def _stretches(clip: Clip) -> list[slice]:
    assert clip.object_motion is not None
    hands = clip.hand_contact
    known = _resting(clip.object_motion.T_world_object) | hands.any(axis=1)
    known = np.pad(known, 2 * _BRIDGED, constant_values=True)
    known = np.asarray(binary_closing(known, np.ones(2 * _BRIDGED + 1, bool)))
    known = known[2 * _BRIDGED : -2 * _BRIDGED]
    found = [slice(a, b) for a, b in runs(known) if b - a >= SHORTEST]
    return [part for part in found if hands[part].any(axis=1).sum() >= LEAST_CONTACT]


def _resting(T: Float[np.ndarray, "frames 4 4"]) -> Bool[np.ndarray, " frames"]:
    speed = np.linalg.norm(np.gradient(T[:, :3, 3], 1.0 / FPS, axis=0), axis=-1)
    return (speed < _RESTING) & (turning_speed(T[:, :3, :3], FPS) < _NOT_TURNING)


def _part(clip: Clip, part: slice, name: str) -> Clip:
    whole = clip.object_motion
    assert whole is not None
    return replace(
        clip,
        name=name,
        root=clip.root[part],
        rotations=clip.rotations[part],
        hand_contact=clip.hand_contact[part],
        foot_contact=clip.foot_contact[part],
        object_motion=ObjectMotion(whole.mesh, whole.T_world_object[part], whole.valid[part]),
    )


def _read(path: Path) -> tuple[SmplPerson, Float[np.ndarray, "frames 4 4"]]:
    """A person and T_world_object, z up, at 30 fps."""
    data, T = _person(path), _poses(path)
    if len(T) != len(data["joints"]):
        raise _odd(path, f"there are {len(data['joints'])} poses and {len(T)} of the object")
    if len(T) / _RATE < 0.8:
        raise InputError("mocap-empty", "The take is shorter than 0.8 s.", where=str(path))
    pose = np.concatenate([data["global_orient"][:, None], data["body_pose"]], axis=1)
    R = world_rotations(pose)
    joints = data["joints"][:, [*range(22), *_PALMS]]
    above = list(MODEL_PARENTS[1:])
    local = np.einsum("tjba,tjb->tja", R[:, above], joints[:, 1:] - joints[:, above])
    bones = np.concatenate([np.zeros((1, 3)), np.median(local, axis=0)])
    check_legs(leg(bones), str(path))
    points = np.stack([joints[:, 0], T[:, :3, 3]], axis=1) @ R_ZUP["y"].T
    turned = R_ZUP["y"] @ np.concatenate([R, T[:, None, :3, :3]], axis=1)
    points, turned = resample(points, turned, _RATE)
    moved = np.tile(np.eye(4), (len(points), 1, 1))
    moved[:, :3, :3], moved[:, :3, 3] = turned[:, 22], points[:, 1]
    return SmplPerson(points[:, 0], turned[:, :22], bones), moved


def _person(path: Path) -> dict[str, np.ndarray]:
    found = read_pickled_array(path, "arr_0")
    raw = cast(dict[str, Any], found[0]) if found and isinstance(found[0], dict) else {}
    data: dict[str, np.ndarray] = {}
    for key, shape in _SHAPES.items():
        try:
            data[key] = np.asarray(raw[key], float).reshape(-1, *shape)
        except (KeyError, TypeError, ValueError) as problem:
            raise _odd(path, f"'{key}' is missing or odd") from problem
        if len(data[key]) != len(data["global_orient"]):
            raise _odd(path, f"'{key}' has another length")
        _check_finite(data[key], path, key)
    return data


def _poses(path: Path) -> Float[np.ndarray, "frames 4 4"]:
    file = _object_poses(path.parent)
    assert file is not None
    try:
        T = np.asarray(np.load(file, allow_pickle=False), float).reshape(-1, 4, 4)
    except (OSError, EOFError, ValueError, TypeError) as problem:
        raise _odd(file, f"{problem}") from problem
    _check_finite(T, file, "the object's pose")
    R = T[:, :3, :3]
    if len(T) == 0 or np.abs(R @ R.swapaxes(1, 2) - np.eye(3)).max() > 0.01:
        raise _odd(file, "the poses are no rotations")
    T[:, :3, :3] = nearest_rotation(R)
    return T


def _check_finite(array: np.ndarray, path: Path, what: str) -> None:
    bad = ~np.isfinite(array).reshape(len(array), -1).all(axis=1)
    if bad.any():
        where = f"{path}, frame {int(bad.argmax())}"
        raise InputError("mocap-not-finite", f"{what} is not a number.", where=where)


def _object_poses(folder: Path) -> Path | None:
    smooth = folder / "smooth_objposes.npy"
    files = [smooth] if smooth.is_file() else sorted(folder.glob("object_poses*.npy"))
    return files[0] if files else None


def _mesh(path: Path) -> ObjectMesh:
    card = path.parent / "object_metadata.json"
    try:
        name = str(json.loads(card.read_text(encoding="utf-8"))["obj_name"]).lower()
    except (OSError, ValueError, KeyError, TypeError) as problem:
        raise _odd(card, "the object has no name") from problem
    if not name.isalnum():
        raise _odd(card, f"'{name}' is no name of an object")
    kind = name.rstrip("0123456789")
    inside = Path("object_models", kind, f"{name}_m.obj")
    file = next((p / inside for p in path.absolute().parents[:6] if (p / inside).is_file()), None)
    if file is None:
        raise InputError(
            "core4d-mesh",
            f"The mesh {inside} is not there.",
            where=str(path),
            fix="Keep object_models beside human_object_motions.",
        )
    try:
        solid = trimesh.load_mesh(file, process=False)
        vertices, faces = np.asarray(solid.vertices, float), np.asarray(solid.faces, int)
    except (OSError, ValueError, AttributeError, IndexError, TypeError) as problem:
        raise InputError("core4d-mesh", f"It cannot be read: {problem}.", where=str(file)) from (
            problem
        )
    if len(faces) == 0 or not np.isfinite(vertices).all():
        raise InputError("core4d-mesh", "The object has no surface.", where=str(file))
    return thinned(ObjectMesh(vertices, faces, kind))


def _odd(path: Path, why: str) -> InputError:
    return InputError("core4d-format", f"This is no take of CORE4D: {why}.", where=str(path))
