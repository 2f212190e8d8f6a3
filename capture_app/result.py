"""`motion.npz` of a result folder: the samples of a person's motion and the object they moved."""

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from capture_app.manifest import MANIFEST, MOTION, Manifest, chosen_sample, read_manifest
from capture_app.motion_arrays import (
    damaged,
    motion_arrays,
    read_arrays,
    sample_file,
    unsolved_samples,
)
from capture_app.picture_bytes import decoded, encoded
from omomo_core.body.grip import GRIPS
from omomo_core.body.model import BodyModel, load_body, with_height
from omomo_core.contact.segment import ContactSegment
from omomo_core.errors import InputError, in_words, reading
from omomo_core.generation.person import FingerFit, Person
from omomo_core.geometry.rotations import matrix_from_xyzw, same_numbers, xyzw_from_matrix
from omomo_core.motion import FPS, HumanMotion, ObjectMesh, ObjectMotion, Texture
from omomo_core.skeleton import BODY_JOINTS, FINGER_JOINTS
from omomo_core.whole_file import whole_file

_PLAIN = ("root", "joints", "hand_contact", "foot_contact")
"""Arrays of a HumanMotion that are written as they are."""
JOINT_NAMES = (*BODY_JOINTS, "left_palm", "right_palm")


@dataclass(frozen=True)
class Result:
    """A result folder in memory."""

    folder: Path
    manifest: Manifest
    people: tuple[Person, ...]
    """The samples; `manifest.chosen` is the index of the best."""
    object_motion: ObjectMotion
    unsolved: frozenset[int] = frozenset()
    """Indices of samples that are as they were sampled; `solved_result` solves them."""

    @property
    def motions(self) -> tuple[HumanMotion, ...]:
        """The samples' bodies."""
        return tuple(person.human for person in self.people)

    @property
    def best(self) -> HumanMotion:
        """The chosen sample's body."""
        return self.motions[self.manifest.chosen]


def load_result(folder: Path) -> Result:
    """Read a result folder.

    Raises:
        InputError: it is none, or damaged.
    """
    manifest = read_manifest(folder / MANIFEST)
    path = folder / MOTION
    data = motion_arrays(path)
    people, object_motion = _people(path, data), _object_of(path, data)
    if manifest.chosen >= len(people):
        raise damaged(path, "it holds fewer samples than the manifest says")
    unsolved = unsolved_samples(folder)
    for k in range(len(people)):
        if k not in unsolved and (later := sample_file(folder, k)).is_file():
            people[k] = _people(later, motion_arrays(later))[0]
    return Result(folder, manifest, tuple(people), object_motion, unsolved)


def save_sample_of(result: Result, index: int, person: Person) -> Person:
    """Keep a sample that was solved after the run, and return it as it will be read.

    A result folder that cannot be written stays as it is.
    """
    path = sample_file(result.folder, index)
    arrays = _people_arrays([person])
    with suppress(InputError), whole_file(path) as unfinished:
        _write(unfinished, arrays)
    return _person(arrays, 0)


def sample_index(result: Result, number: int | None) -> int:
    """Index of the sample that the user numbers from 1; of the chosen one if not given.

    Raises:
        InputError: "sample-missing".
    """
    return chosen_sample(result.manifest, number, result.folder)


def body_of(result: Result) -> BodyModel:
    """The body that a result's motion is on.

    Raises:
        AssetError: it was the user's own, and is not where it was.
    """
    given = [Path(item.path) for item in result.manifest.inputs if item.role == "body"]
    return with_height(load_body(given[0] if given else None), result.manifest.body.height)


def save_motion(
    path: Path,
    people: Sequence[Person],
    chosen: int,
    object_motion: ObjectMotion,
    body_name: str,
    unsolved: Collection[int] = (),
) -> None:
    """Write the arrays that docs/format.md describes; the same motion gives the same bytes.

    Args:
        path: the .npz file to write (no pickle in it).
        people: K samples of equal length.
        chosen: index of the best one.
        object_motion: as many frames as the samples.
        body_name: the body whose bones the samples move.
        unsolved: indices of samples that are as they were sampled.
    """
    solved = np.array([k not in unsolved for k in range(len(people))])
    arrays: dict[str, np.ndarray] = {
        "fps": np.array(FPS, np.float32),
        "chosen": np.array(chosen, np.int32),
        **({} if solved.all() else {"solved": solved}),
        "body": np.array(body_name),
        "joint_names": np.array(JOINT_NAMES),
        "rotation_names": np.array(BODY_JOINTS),
        "finger_names": np.array(FINGER_JOINTS),
        "grip_names": np.array(GRIPS),
        **_people_arrays(people),
        **_object_arrays(object_motion),
    }
    _write(path, arrays)


def save_corrected(path: Path, before: Result, index: int, person: Person) -> None:
    """Write a result's arrays again with one sample, as corrected, in place of all samples.

    What is the same has the same numbers, to the last bit.

    Args:
        path: the .npz file to write.
        before: the result; its file is read again.
        index: of the sample that was corrected.
        person: that sample, corrected.
    """
    arrays, new = read_arrays(before.folder / MOTION), _people_arrays([person])
    later = sample_file(before.folder, index)
    old, row = (read_arrays(later), 0) if later.is_file() else (arrays, index)
    for key in ("rotations_xyzw", "fingers_xyzw"):
        new[key] = same_numbers(new[key][0], old[key][row])[None]
    arrays.pop("solved", None)
    _write(path, {**arrays, **new, "chosen": np.array(0, np.int32)})


def _write(path: Path, arrays: dict[str, np.ndarray]) -> None:
    # numpy stamps every member 1980-01-01: equal arrays make equal files.
    np.savez_compressed(path, allow_pickle=False, **arrays)


def load_motion(path: Path) -> tuple[tuple[Person, ...], ObjectMotion]:
    """Read what `save_motion` wrote: the samples and the object's motion.

    Raises:
        InputError: the file is missing or damaged.
    """
    data = motion_arrays(path)
    return tuple(_people(path, data)), _object_of(path, data)


def _people(path: Path, data: dict[str, np.ndarray]) -> list[Person]:
    # Arrays may be missing, or not fit each other.
    with reading(partial(damaged, path), words=in_words):
        return [_person(data, k) for k in range(len(data["root"]))]


def _object_of(path: Path, data: dict[str, np.ndarray]) -> ObjectMotion:
    with reading(partial(damaged, path), words=in_words):
        return _object_motion(data)


def _people_arrays(people: Sequence[Person]) -> dict[str, np.ndarray]:
    motions = [person.human for person in people]
    spans = [(k, s.hand, s.start, s.stop) for k, p in enumerate(people) for s in p.segments]
    anchors = [s.anchor for p in people for s in p.segments]
    arrays = {key: np.stack([getattr(m, key) for m in motions]) for key in _PLAIN}
    arrays["rotations_xyzw"] = np.stack([xyzw_from_matrix(m.rotations) for m in motions])
    arrays["fingers_xyzw"] = np.stack([xyzw_from_matrix(m.fingers) for m in motions])
    arrays["palm_miss"] = np.stack([p.miss for p in people])
    arrays["inside"] = np.stack([p.depth for p in people])
    arrays["contact_anchors"] = np.array(anchors).reshape(-1, 3)
    single: dict[str, np.ndarray] = {k: array.astype(np.float32) for k, array in arrays.items()}
    single |= _finger_arrays([p.finger_fit for p in people], len(motions[0].root))
    return {**single, "contact_spans": np.array(spans, np.int32).reshape(-1, 4)}


def _finger_arrays(fits: Sequence[FingerFit | None], frames: int) -> dict[str, np.ndarray]:
    """Arrays of how fingers lie, 0 where that was not measured of a sample; none if it was of no sample."""
    if all(fit is None for fit in fits):
        return {}
    nothing = np.zeros((frames, 2))
    unknown = FingerFit(nothing, nothing, nothing.astype(np.int64))
    known = [fit or unknown for fit in fits]
    return {
        "finger_depth": np.stack([f.depth for f in known]).astype(np.float32),
        "pad_distance": np.stack([f.pad_distance for f in known]).astype(np.float32),
        "grip": np.stack([f.grip for f in known]).astype(np.uint8),
    }


def _object_arrays(moved: ObjectMotion) -> dict[str, np.ndarray]:
    T = moved.T_world_object
    return {
        "object_position": T[:, :3, 3].astype(np.float32),
        "object_rotation_xyzw": xyzw_from_matrix(T[:, :3, :3]).astype(np.float32),
        "object_vertices": moved.mesh.vertices.astype(np.float32),
        "object_faces": moved.mesh.faces.astype(np.int32),
        "object_name": np.array(moved.mesh.name),
        "valid": moved.valid,
        "start_time": np.array(moved.start_time, np.float64),
        **_texture_arrays(moved.mesh.texture),
    }


def _texture_arrays(texture: Texture | None) -> dict[str, np.ndarray]:
    if texture is None:
        return {}
    picture = np.frombuffer(encoded(texture.image).data, np.uint8)
    return {"object_uv": texture.uv.astype(np.float32), "object_texture": picture}


def _texture(data: dict[str, np.ndarray]) -> Texture | None:
    if "object_uv" not in data:
        return None
    return Texture(data["object_uv"], decoded(data["object_texture"].tobytes()))


def _person(data: dict[str, np.ndarray], k: int) -> Person:
    human = HumanMotion(
        rotations=matrix_from_xyzw(data["rotations_xyzw"][k]).astype(np.float32),
        fingers=matrix_from_xyzw(data["fingers_xyzw"][k]).astype(np.float32),
        **{key: data[key][k] for key in _PLAIN},
    )
    anchors = data["contact_anchors"].astype(np.float64)
    contacts = zip(data["contact_spans"].tolist(), anchors, strict=True)
    segments = tuple(
        ContactSegment(hand, start, stop, anchor)
        for (sample, hand, start, stop), anchor in contacts
        if sample == k
    )
    fit = None
    if "grip" in data and ("solved" not in data or data["solved"][k]):
        fit = FingerFit(
            data["finger_depth"][k], data["pad_distance"][k], data["grip"][k].astype(np.int64)
        )
    return Person(human, segments, data["palm_miss"][k], data["inside"][k], fit)


def _object_motion(data: dict[str, np.ndarray]) -> ObjectMotion:
    T = np.tile(np.eye(4), (len(data["valid"]), 1, 1))
    T[:, :3, :3] = matrix_from_xyzw(data["object_rotation_xyzw"])
    T[:, :3, 3] = data["object_position"]
    name = str(data["object_name"])
    mesh = ObjectMesh(data["object_vertices"], data["object_faces"], name, _texture(data))
    return ObjectMotion(mesh, T, data["valid"], float(data["start_time"]))
