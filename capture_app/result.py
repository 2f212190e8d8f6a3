"""`motion.npz` of a result folder: the samples of a person's motion and the object they moved."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from capture_app.manifest import MANIFEST, MOTION, Manifest, chosen_sample, read_manifest
from capture_app.motion_arrays import (
    damaged,
    reading_motion,
    sample_file,
    unsolved_samples,
)
from capture_app.picture_bytes import decoded, encoded
from omomo_core.array_archive import (
    ArrayBlocks,
    array_archive,
    array_blocks,
    names_in,
    read_arrays,
    read_row,
    shapes_of,
)
from omomo_core.body.grip import GRIPS
from omomo_core.body.model import BodyModel, load_body, with_height
from omomo_core.contact.segment import ContactSegment
from omomo_core.errors import DamageError, InputError
from omomo_core.generation.person import FingerFit, Person
from omomo_core.geometry.rotations import matrix_from_xyzw, same_numbers, xyzw_from_matrix
from omomo_core.long_arrays import ReadLater, in_blocks
from omomo_core.motion import FPS, HumanMotion, ObjectMesh, ObjectMotion, Texture
from omomo_core.skeleton import BODY_JOINTS, FINGER_JOINTS
from omomo_core.whole_file import whole_file

_PLAIN = ("root", "joints", "hand_contact", "foot_contact")
"""Arrays of a HumanMotion that are written as they are."""
_OF_A_SAMPLE = (*_PLAIN, "rotations_xyzw", "fingers_xyzw", "palm_miss", "inside")
_FINGERS = ("finger_depth", "pad_distance", "grip")
"""Arrays with a row for each sample, and those of them that a file may lack."""
Arrays = dict[str, np.ndarray | ArrayBlocks]
JOINT_NAMES = (*BODY_JOINTS, "left_palm", "right_palm")


@dataclass(frozen=True)
class Result:
    """A result folder in memory."""

    folder: Path
    manifest: Manifest
    people: Sequence[Person]
    """The samples, each read when it is first looked at; `manifest.chosen` is the index of the best."""
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
        return self.people[self.manifest.chosen].human

    @property
    def start(self) -> Float[np.ndarray, "2"]:
        """Place on the floor at which the chosen sample begins, world, metres."""
        return read_row(self.folder / MOTION, ["root"], self.manifest.chosen)["root"][0, :2]


def load_result(folder: Path) -> Result:
    """Read a result folder.

    Raises:
        InputError: it is none, or damaged.
    """
    manifest = read_manifest(folder / MANIFEST)
    path = folder / MOTION
    count = _samples_in(path)
    if manifest.chosen >= count:
        raise damaged(path, "it holds fewer samples than the manifest says")
    unsolved, sources = unsolved_samples(folder), [(path, k) for k in range(count)]
    for k in range(count):
        if k not in unsolved and (later := sample_file(folder, k)).is_file():
            sources[k] = later, 0
            _samples_in(later)
    people = ReadLater(count, lambda k: _read_person(*sources[k]), keep=True)
    return Result(folder, manifest, people, _object_of(path), unsolved)


def save_sample_of(result: Result, index: int, person: Person) -> Person:
    """Keep a sample that was solved after the run, and return it as it will be read.

    A result folder that cannot be written stays as it is.
    """
    path = sample_file(result.folder, index)
    arrays = _whole(_people_arrays([person]))
    with suppress(InputError), whole_file(path) as unfinished:
        _write(unfinished, arrays)
    own = {name: arrays[name][0] for name in (*_OF_A_SAMPLE, *_FINGERS) if name in arrays}
    return _person(own, arrays["contact_spans"], arrays["contact_anchors"], 0)


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
    arrays: Arrays = {
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
    arrays, new = read_arrays(before.folder / MOTION), _whole(_people_arrays([person]))
    later = sample_file(before.folder, index)
    old, row = (read_arrays(later), 0) if later.is_file() else (arrays, index)
    for key in ("rotations_xyzw", "fingers_xyzw"):
        new[key] = same_numbers(new[key][0], old[key][row])[None]
    arrays.pop("solved", None)
    _write(path, {**arrays, **new, "chosen": np.array(0, np.int32)})


def _write(path: Path, arrays: Mapping[str, np.ndarray | ArrayBlocks]) -> None:
    with array_archive(path, compressed=True) as archive:
        archive.write(arrays)


def load_motion(path: Path) -> tuple[tuple[Person, ...], ObjectMotion]:
    """Read what `save_motion` wrote: the samples and the object's motion.

    Raises:
        InputError: the file is missing or damaged.
    """
    people = tuple(_read_person(path, k) for k in range(_samples_in(path)))
    return people, _object_of(path)


def _object_of(path: Path) -> ObjectMotion:
    with reading_motion(path):
        return _object_motion(
            read_arrays(path, lambda name: name not in (*_OF_A_SAMPLE, *_FINGERS))
        )


def _people_arrays(people: Sequence[Person]) -> Arrays:
    spans = [(k, s.hand, s.start, s.stop) for k, p in enumerate(people) for s in p.segments]
    anchors = np.array([s.anchor for p in people for s in p.segments]).reshape(-1, 3)
    motions = [person.human for person in people]
    arrays: Arrays = {key: _stacked([getattr(m, key) for m in motions]) for key in _PLAIN}
    arrays["rotations_xyzw"] = _stacked([m.rotations for m in motions], turns=True)
    arrays["fingers_xyzw"] = _stacked([m.fingers for m in motions], turns=True)
    arrays["palm_miss"] = _stacked([p.miss for p in people])
    arrays["inside"] = _stacked([p.depth for p in people])
    arrays["contact_anchors"] = anchors.astype(np.float32)
    arrays |= _finger_arrays([p.finger_fit for p in people], len(motions[0].root))
    return {**arrays, "contact_spans": np.array(spans, np.int32).reshape(-1, 4)}


def _stacked(each: Sequence[np.ndarray], *, turns: bool = False) -> ArrayBlocks:
    """Return the arrays of all samples as one of single precision; rotation matrices as quaternions."""
    shape = (*each[0].shape[:-2], 4) if turns else each[0].shape
    blocks = chain.from_iterable(map(_quaternions if turns else array_blocks, each))
    return ArrayBlocks((len(each), *shape), np.dtype(np.float32), blocks)


def _quaternions(
    R: Float[np.ndarray, "frames joints 3 3"],
) -> Iterator[Float[np.ndarray, "some joints 4"]]:
    before = None
    for some in array_blocks(R):
        yield (q := xyzw_from_matrix(some, before))
        before = q[-1]


def _whole(arrays: Arrays) -> dict[str, np.ndarray]:
    return {k: x.whole() if isinstance(x, ArrayBlocks) else x for k, x in arrays.items()}


def _finger_arrays(fits: Sequence[FingerFit | None], frames: int) -> Arrays:
    """Arrays of how fingers lie, 0 where that was not measured of a sample; none if it was of no sample."""
    if all(fit is None for fit in fits):
        return {}
    nothing = np.zeros((frames, 2))
    unknown = FingerFit(nothing, nothing, nothing.astype(np.int64))
    known = [fit or unknown for fit in fits]
    return {
        "finger_depth": _stacked([f.depth for f in known]),
        "pad_distance": _stacked([f.pad_distance for f in known]),
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


def _samples_in(path: Path) -> int:
    """Return how many samples a file has; every byte of it is checked.

    Raises:
        InputError: "result-missing" or "result-damaged".
    """
    with reading_motion(path):
        shapes = shapes_of(path)
        count, frames = shapes["root"][:2]
        fitted = _FINGERS if "grip" in shapes else ()
        if any(shapes[name][:2] != (count, frames) for name in (*_OF_A_SAMPLE, *fitted)):
            raise DamageError("its arrays do not fit each other")
        return count


def _read_person(path: Path, k: int) -> Person:
    with reading_motion(path):
        shared = read_arrays(
            path, lambda name: name in ("contact_spans", "contact_anchors", "solved")
        )
        fitted = "grip" in names_in(path) and ("solved" not in shared or shared["solved"][k])
        own = read_row(path, (*_OF_A_SAMPLE, *(_FINGERS if fitted else ())), k)
        return _person(own, shared["contact_spans"], shared["contact_anchors"], k)


def _person(
    data: Mapping[str, np.ndarray],
    spans: Int[np.ndarray, "spans 4"],
    anchors: Float[np.ndarray, "spans 3"],
    k: int,
) -> Person:
    """Return a sample from its own arrays and the contacts of all samples."""
    human = HumanMotion(
        rotations=in_blocks(_matrices, data["rotations_xyzw"]),
        fingers=in_blocks(_matrices, data["fingers_xyzw"]),
        **{key: data[key] for key in _PLAIN},
    )
    segments = tuple(
        ContactSegment(hand, start, stop, anchor)
        for (sample, hand, start, stop), anchor in zip(
            spans.tolist(), anchors.astype(np.float64), strict=True
        )
        if sample == k
    )
    fit = None
    if "grip" in data:
        grip = data["grip"].astype(np.int64)
        fit = FingerFit(data["finger_depth"], data["pad_distance"], grip)
    return Person(human, segments, data["palm_miss"], data["inside"], fit)


def _matrices(q: Float[np.ndarray, "frames joints 4"]) -> Float[np.ndarray, "frames joints 3 3"]:
    return matrix_from_xyzw(q).astype(np.float32)


def _object_motion(data: dict[str, np.ndarray]) -> ObjectMotion:
    T = np.tile(np.eye(4), (len(data["valid"]), 1, 1))
    T[:, :3, :3] = matrix_from_xyzw(data["object_rotation_xyzw"])
    T[:, :3, 3] = data["object_position"]
    name = str(data["object_name"])
    mesh = ObjectMesh(data["object_vertices"], data["object_faces"], name, _texture(data))
    return ObjectMotion(mesh, T, data["valid"], float(data["start_time"]))
