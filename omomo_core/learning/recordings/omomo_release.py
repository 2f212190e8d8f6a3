"""The OMOMO release's processed files: sequences, objects and people.

The layout is that of ``{train,test}_diffusion_manip_seq_joints24.p`` (github.com/lijiaman/omomo_release,
manip/data/hand_foot_dataset.py): a dict of dicts with seq_name, trans, root_orient, pose_body,
rest_offsets, trans2joint, obj_trans, obj_rot, obj_scale, and obj_bottom_* of mops and vacuums; 30 fps,
z up, metres.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, cast

import numpy as np
import trimesh
from jaxtyping import Float

from omomo_core.body.model import BodyModel
from omomo_core.errors import InputError
from omomo_core.learning.recordings.clips import Clip
from omomo_core.learning.recordings.joblib_file import read_joblib
from omomo_core.learning.recordings.mocap import check_legs
from omomo_core.learning.recordings.smpl import (
    ClipOrigin,
    SmplPerson,
    leg,
    person_clip,
    size_of,
    world_rotations,
)
from omomo_core.learning.recordings.splits import Side, cast_of, side_of
from omomo_core.motion import ObjectMesh, ObjectMotion

_TWO_PARTS = ("mop", "vacuum")
_MOST_VERTICES = 2000
"""The release's scans have ten times as many: more than 4 s of training ever look at."""


class ReleaseObjects:
    """Reads each mesh once, thins it, and brings it to the size it has in a sequence."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._read: dict[str, ObjectMesh] = {}
        self._sized: dict[tuple[str, float], ObjectMesh] = {}

    def mesh(self, sequence: Mapping[str, Any], scale: float, where: str) -> ObjectMesh:
        """The object of a sequence in its own frame, metres times `scale`.

        A mop or vacuum is made one rigid thing, as its parts stand to each other in most frames.

        Raises:
            InputError: ``release-mesh`` when it is missing or damaged, ``release-format`` when the
                sequence's name or its bottom part cannot be used.
        """
        words = str(sequence["seq_name"]).split("_")
        if len(words) < 2:
            raise InputError("release-format", "The name does not tell the object.", where=where)
        name = words[1]
        # To four digits, so that sequences of one size share a mesh.
        size = float(f"{np.median(np.asarray(sequence['obj_scale'])) * scale:.4g}")
        if name in _TWO_PARTS:
            top, bottom = (self._part(f"{name}_cleaned_simplified_{p}") for p in ("top", "bottom"))
            return _resized(_joined(name, sequence, top, bottom, where), size)
        if (name, size) not in self._sized:
            whole = self._part(f"{name}_cleaned_simplified")
            self._sized[name, size] = _resized(whole, size, name)
        return self._sized[name, size]

    def _part(self, part: str) -> ObjectMesh:
        if part not in self._read:
            path = self._folder / f"{part}.obj"
            try:
                solid = trimesh.load_mesh(path, process=False)
                vertices, faces = np.asarray(solid.vertices, float), np.asarray(solid.faces, int)
            except (OSError, ValueError, AttributeError, IndexError, TypeError) as problem:
                raise InputError(
                    "release-mesh", f"The object cannot be read: {problem}.", where=str(path)
                ) from problem
            if len(faces) == 0 or not np.isfinite(vertices).all():
                raise InputError("release-mesh", "The object has no surface.", where=str(path))
            self._read[part] = thinned(ObjectMesh(vertices, faces, part))
        return self._read[part]


def thinned(mesh: ObjectMesh, most: int = _MOST_VERTICES) -> ObjectMesh:
    """The mesh with vertices that share a cell of a grid joined into one, fine enough for `most`."""
    cell = float(np.ptp(mesh.vertices, axis=0).max()) / 400
    while len(mesh.vertices) > most:
        key = np.floor(mesh.vertices / cell).astype(np.int64)
        _, group = np.unique(key, axis=0, return_inverse=True)
        group = group.reshape(-1)
        count = np.bincount(group)
        joined = np.stack([np.bincount(group, mesh.vertices[:, k]) / count for k in range(3)], 1)
        faces = group[mesh.faces]
        whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        mesh = ObjectMesh(joined, np.unique(faces[whole], axis=0), mesh.name)
        cell *= 1.25
    return mesh


def _joined(
    name: str, sequence: Mapping[str, Any], top: ObjectMesh, bottom: ObjectMesh, where: str
) -> ObjectMesh:
    """Both parts in the top's frame and units, as they stand to each other in most frames."""
    R_t, t_t, s_t = _poses(sequence, "obj", where)
    R_b, t_b, s_b = _poses(sequence, "obj_bottom", where)
    if len(R_t) != len(R_b):
        raise InputError("release-format", "'obj_bottom_rot' has another length.", where=where)

    def in_top(points: Float[np.ndarray, "n 3"], k: slice) -> Float[np.ndarray, "frames n 3"]:
        world = s_b[k, None, None] * points @ R_b[k].swapaxes(1, 2) + t_b[k, None]
        return (world - t_t[k, None]) @ R_t[k] / s_t[k, None, None]

    low, high = bottom.vertices.min(axis=0), bottom.vertices.max(axis=0)
    corners = low + (high - low) * list(product((0, 1), repeat=3))
    ways = in_top(corners, slice(None))
    k = int(np.linalg.norm(ways - np.median(ways, axis=0), axis=-1).sum(axis=1).argmin())
    vertices = np.concatenate([top.vertices, in_top(bottom.vertices, slice(k, k + 1))[0]])
    return ObjectMesh(vertices, np.concatenate([top.faces, bottom.faces + len(top.vertices)]), name)


def _poses(
    sequence: Mapping[str, Any], part: str, where: str
) -> tuple[
    Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"], Float[np.ndarray, " frames"]
]:
    shapes: dict[str, tuple[int, ...]] = {"rot": (3, 3), "trans": (3,), "scale": ()}
    found: list[np.ndarray] = []
    for key, shape in shapes.items():
        try:
            found.append(np.asarray(sequence[f"{part}_{key}"], float).reshape(-1, *shape))
        except (KeyError, TypeError, ValueError) as problem:
            what = f"'{part}_{key}' is missing or odd."
            raise InputError("release-format", what, where=where) from problem
        if len(found[-1]) != len(found[0]) or not np.isfinite(found[-1]).all():
            what = f"'{part}_{key}' has another length or is not finite."
            raise InputError("release-format", what, where=where)
    R, t, scale = found
    if not (scale > 0).all():
        raise InputError("release-format", f"'{part}_scale' is not positive.", where=where)
    return R, t, scale


def _resized(mesh: ObjectMesh, size: float, name: str | None = None) -> ObjectMesh:
    return ObjectMesh(
        (mesh.vertices * size).astype(np.float32), mesh.faces.astype(np.int32), name or mesh.name
    )


MESHES = "captured_objects"
_SHAPES: dict[str, tuple[int, ...]] = {
    "trans": (3,),
    "root_orient": (3,),
    "pose_body": (63,),
    "obj_trans": (3,),
    "obj_rot": (3, 3),
    "obj_scale": (),
}
"""Shapes of the channels of a sequence, after the frames."""
_SHORTEST = 24
_SKEWED = 1e-3
"""What a rotation times its transpose may differ from the identity."""


@dataclass(frozen=True)
class ReleaseSequence(SmplPerson):
    """A person with their own bones who moves an object."""

    name: str
    where: str
    """File and name, for errors."""
    T_world_object: Float[np.ndarray, "frames 4 4"]
    raw: Mapping[str, Any]
    objects: ReleaseObjects

    def moved(self, scale: float = 1.0) -> ObjectMotion:
        """The object in a world `scale` times as large.

        Raises:
            InputError: as `ReleaseObjects.mesh`.
        """
        T = self.T_world_object.copy()
        T[:, :3, 3] *= scale
        mesh: ObjectMesh = self.objects.mesh(self.raw, scale, self.where)
        return ObjectMotion(mesh, T, np.ones(len(T), bool))


def read_release(
    path: Path, *, object_split: bool = False
) -> Iterator[ReleaseSequence | InputError]:
    """Every sequence of a release file, or what is wrong with it.

    Args:
        path: ``train_...p`` or ``test_...p``, which hold people 1-15 and 16-17, or a file of another
            name, which may hold anybody; the folder ``captured_objects`` stands beside it or one
            folder up.
        object_split: only the ten objects of training, and of a test file only the other five.

    Raises:
        InputError: as `read_joblib`; ``release-format`` when the file holds no sequences;
            ``release-meshes`` when the folder of objects is not there.
    """
    sequences = _named(read_joblib(path), path)
    folder = next((p / MESHES for p in path.absolute().parents[:2] if (p / MESHES).is_dir()), None)
    if folder is None:
        raise InputError(
            "release-meshes",
            f"The release's folder {MESHES} is not beside the file.",
            where=str(path),
            fix="Keep the release's folders together.",
        )
    objects = ReleaseObjects(folder)
    for name, sequence in sequences:
        try:
            _check_side(name, path, object_split=object_split)
            yield _sequence(name, sequence, objects, f"{path}, {name}")
        except InputError as problem:
            yield problem


def _named(content: object, path: Path) -> list[tuple[str, Mapping[str, Any]]]:
    sequences = cast(dict[Any, Any], content if isinstance(content, dict) else {None: None})
    named: list[tuple[str, Mapping[str, Any]]] = []
    for key, sequence in sequences.items():
        if not isinstance(sequence, dict) or "seq_name" not in sequence:
            raise InputError(
                "release-format",
                "These are not the release's processed sequences: there must be a seq_name in each.",
                where=f"{path}, entry {key}",
                fix="Give train_diffusion_manip_seq_joints24.p.",
            )
        named.append((str(sequence["seq_name"]), cast(Mapping[str, Any], sequence)))
    return named


def _check_side(name: str, path: Path, *, object_split: bool) -> None:
    """Refuse what the file, by its own name, must not hold, and what is not asked for.

    Raises:
        InputError: ``release-split``, ``object-split``.
    """
    test = path.name.startswith("test_")
    if test or path.name.startswith("train_"):
        expected: Side = "seen" if test else "train"
        if side_of(name, object_split=False) != expected:
            raise InputError(
                "release-split",
                f"{name} is of nobody that a {'test' if test else 'training'} file of the release "
                "holds (training: sub1 to sub15, test: sub16 and sub17).",
                where=f"{path}, {name}",
                fix="Use the original file; one of your own must not begin with train_ or test_.",
            )
    if object_split and side_of(name) != ("unseen" if test else "train"):
        found = cast_of(name)
        raise InputError(
            "object-split",
            f"{found.object if found else name} is left out by the split of the objects.",
            where=f"{path}, {name}",
        )


def _sequence(
    name: str, raw: Mapping[str, Any], objects: ReleaseObjects, where: str
) -> ReleaseSequence:
    data = _channels(raw, where)
    bones, origin = _rest(raw, where)
    pose = np.concatenate([data["root_orient"], data["pose_body"]], axis=1)
    T = np.tile(np.eye(4), (len(pose), 1, 1))
    T[:, :3, :3], T[:, :3, 3] = data["obj_rot"], data["obj_trans"]
    return ReleaseSequence(
        name=name,
        where=where,
        pelvis=data["trans"] - origin,
        rotations=world_rotations(pose.reshape(-1, 22, 3)),
        bones=bones,
        T_world_object=T,
        raw=raw,
        objects=objects,
    )


def _channels(raw: Mapping[str, Any], where: str) -> dict[str, np.ndarray]:
    """The channels of a sequence, as many frames of each.

    Raises:
        InputError: ``release-format``, ``mocap-not-finite``, ``mocap-empty``.
    """
    data: dict[str, np.ndarray] = {}
    for key, shape in _SHAPES.items():
        try:
            found = np.asarray(raw[key], float)
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
    _check_rigid(data["obj_rot"], data["obj_scale"], where)
    return data


def _check_rigid(
    R: Float[np.ndarray, "frames 3 3"], scale: Float[np.ndarray, " frames"], where: str
) -> None:
    skew = np.abs(R @ R.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2))
    bad = (skew > _SKEWED) | (np.linalg.det(R) < 0)
    for key, odd in (("obj_rot", bad), ("obj_scale", scale <= 0)):
        if odd.any():
            what = "no rotation" if key == "obj_rot" else "not positive"
            frame = int(odd.argmax())
            raise InputError("release-format", f"'{key}', frame {frame}, is {what}.", where=where)


def _rest(
    raw: Mapping[str, Any], where: str
) -> tuple[Float[np.ndarray, "24 3"], Float[np.ndarray, "3"]]:
    """Offsets from the parents, and what the translation exceeds the pelvis by."""
    try:
        bones = np.asarray(raw["rest_offsets"], float).reshape(24, 3)
        origin = np.asarray(raw["trans2joint"], float).reshape(3)
    except (KeyError, TypeError, ValueError) as problem:
        key = next((k for k in ("rest_offsets", "trans2joint") if k not in raw), "rest_offsets")
        raise InputError("release-format", f"'{key}' is missing or odd.", where=where) from problem
    if not (np.isfinite(bones[1:]).all() and np.isfinite(origin).all()):
        raise InputError("mocap-not-finite", "The rest pose is NaN.", where=where)
    check_legs(leg(bones), where)
    return bones, origin


LICENCE = "OMOMO data (github.com/lijiaman/omomo_release): its authors state no licence"


def release_clips(
    path: Path, body: BodyModel, *, object_split: bool = False
) -> Iterator[Clip | InputError]:
    """Every sequence of a release file as a clip, or what is wrong with it.

    Args:
        path: as for `read_release`.
        body: whose proportions the clips get.
        object_split: as for `read_release`.

    Raises:
        InputError: as `read_release`.
    """
    for found in read_release(path, object_split=object_split):
        try:
            yield found if isinstance(found, InputError) else _clip(found, body)
        except InputError as problem:
            yield problem


def _clip(sequence: ReleaseSequence, body: BodyModel) -> Clip:
    moved = sequence.moved(size_of(sequence, body))
    return person_clip(sequence, moved, ClipOrigin(sequence.name, "omomo", LICENCE), body)
