"""A file of all people of a take as they were sampled, from which each can be solved.

It is written and read chunk by chunk, so memory holds one chunk of a take of any length.
"""

from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import torch

from omomo_core.array_archive import array_archive, read_arrays
from omomo_core.body.model import BodyModel
from omomo_core.contact.segment import ContactSegment
from omomo_core.errors import InputError, in_words, reading
from omomo_core.generation.decoding import SampledBodies
from omomo_core.generation.generation_options import SolvedPrefix
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.sample_chunks import Chunk, SampledChunk
from omomo_core.generation.sampled_take import SampledTake
from omomo_core.long_arrays import ReadLater
from omomo_core.motion import HandMotion, ObjectMesh
from omomo_core.whole_file import whole_file

Arrays = dict[str, np.ndarray]
_OF_THE_TAKE = ("vertices", "faces", "object_name", "size", "chunks")
_POSED = "posed_"
_PREFIX = ("root", "rotations", "standing")
"""Arrays of a start pose, and what is before their names."""


def save_sampled(
    path: Path, chunks: Iterable[SampledChunk], model: ObjectModel, body: BodyModel
) -> SampledTake:
    """Write chunks as they are sampled, and return the take, which reads them from the file.

    Nothing is rounded, so a person is the same whenever they are solved.
    """
    bounds: list[tuple[int, ...]] = []
    with whole_file(path) as unfinished, array_archive(unfinished) as archive:
        for n, sample in enumerate(chunks):
            archive.write({f"{name}_{n}": array for name, array in _arrays(sample).items()})
            bounds.append(_bounds(sample.chunk))
        archive.write(
            {
                "vertices": model.mesh.vertices,
                "faces": model.mesh.faces,
                "object_name": np.array(model.mesh.name),
                "size": np.array([model.scale, model.shoe_sole]),
                "chunks": np.array(bounds),
            }
        )
    return SampledTake(_read_later(path, bounds, model), model, body, path.parent)


def load_sampled(path: Path, body: BodyModel) -> SampledTake:
    """Read what `save_sampled` wrote.

    Args:
        path: the file.
        body: of the result.

    Raises:
        InputError: "result-damaged"; so does the take when it reads a chunk.
    """
    # Damaged bytes fail in a dozen ways in zipfile and numpy.
    with reading(partial(_damaged, path), words=in_words):
        data = read_arrays(path, lambda name: name in _OF_THE_TAKE)
        mesh = ObjectMesh(data["vertices"], data["faces"], str(data["object_name"]))
        model = ObjectModel(mesh, *data["size"].tolist())
        bounds = data["chunks"].tolist()
        return SampledTake(_read_later(path, bounds, model), model, body)


def _read_later(
    path: Path, bounds: Sequence[Sequence[int]], model: ObjectModel
) -> ReadLater[SampledChunk]:
    """The chunks of a file."""
    return ReadLater(len(bounds), partial(_stored_chunk, path, bounds, model), keep=False)


def _stored_chunk(
    path: Path, bounds: Sequence[Sequence[int]], model: ObjectModel, n: int
) -> SampledChunk:
    own = f"_{n}"
    with reading(partial(_damaged, path), words=in_words):
        data = read_arrays(path, lambda name: name.endswith(own))
        named = {name.removesuffix(own): array for name, array in data.items()}
        return _chunk(bounds[n], named, model)


def _damaged(path: Path, why: str) -> InputError:
    return InputError(
        "result-damaged",
        f"The samples that are not solved yet cannot be read: {why}.",
        where=str(path),
        fix="Run the take again.",
    )


def _bounds(chunk: Chunk) -> tuple[int, int, int, int]:
    return chunk.first, chunk.prefix_frames, chunk.stop, int(chunk.last)


def _arrays(sample: SampledChunk) -> Arrays:
    held = [(k, s) for k, segments in enumerate(sample.segments) for s in segments]
    return {
        **_posed_arrays(sample.posed),
        "poses": sample.chunk.T_world_object,
        "root": sample.bodies.root.numpy(),
        "rotations": sample.bodies.rotations.numpy(),
        "foot_contact": sample.bodies.foot_contact.numpy(),
        "palms": np.stack([hand.palms for hand in sample.hands]),
        "contact": np.stack([hand.contact for hand in sample.hands]),
        "palms_known": np.array(sample.palms_known),
        "spans": np.array([(k, s.hand, s.start, s.stop) for k, s in held], int).reshape(-1, 4),
        "anchors": np.array([s.anchor for _, s in held], float).reshape(-1, 3),
    }


def _posed_arrays(posed: SolvedPrefix | None) -> Arrays:
    if posed is None:
        return {}
    arrays = posed.root.numpy(), posed.rotations.numpy(), posed.standing
    return {_POSED + name: array for name, array in zip(_PREFIX, arrays, strict=True)}


def _posed(data: Arrays) -> SolvedPrefix | None:
    if _POSED + _PREFIX[0] not in data:
        return None
    root, rotations, standing = (data[_POSED + name] for name in _PREFIX)
    return SolvedPrefix(torch.from_numpy(root), torch.from_numpy(rotations), standing)


def _chunk(bounds: Sequence[int], data: Arrays, model: ObjectModel) -> SampledChunk:
    first, prefix_frames, stop, last = bounds
    spans, anchors = data["spans"].tolist(), data["anchors"]
    hands = [HandMotion(*each) for each in zip(data["palms"], data["contact"], strict=True)]
    segments = [
        tuple(
            ContactSegment(hand, start, stop, anchor)
            for (sample, hand, start, stop), anchor in zip(spans, anchors, strict=True)
            if sample == k
        )
        for k in range(len(hands))
    ]
    bodies = (torch.from_numpy(data[name]) for name in ("root", "rotations", "foot_contact"))
    return SampledChunk(
        Chunk(first, data["poses"], prefix_frames, stop, bool(last)),
        model.clip(data["poses"]),
        hands,
        segments,
        SampledBodies(*bodies),
        bool(data["palms_known"]),
        _posed(data),
    )
