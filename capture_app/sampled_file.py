"""`sampled.npz` of a result folder: all people as they were sampled, from which each can be solved."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import torch

from capture_app.motion_arrays import read_arrays
from omomo_core.body.model import BodyModel
from omomo_core.contact.segment import ContactSegment
from omomo_core.errors import InputError, in_words, reading
from omomo_core.generation.decoding import SampledBodies
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.generation.sample_chunks import Chunk, SampledChunk
from omomo_core.generation.sampled_take import SampledTake
from omomo_core.motion import HandMotion, ObjectMesh
from omomo_core.whole_file import whole_file

Arrays = dict[str, np.ndarray]


def save_sampled(path: Path, take: SampledTake) -> None:
    """Write a sampled take; nothing is rounded, so a person is the same whenever they are solved."""
    model = take.object_model
    arrays: Arrays = {
        "vertices": model.mesh.vertices,
        "faces": model.mesh.faces,
        "object_name": np.array(model.mesh.name),
        "size": np.array([model.scale, model.shoe_sole]),
        "chunks": np.array([_bounds(sample.chunk) for sample in take.chunks]),
    }
    for n, sample in enumerate(take.chunks):
        arrays |= {f"{name}_{n}": array for name, array in _arrays(sample).items()}
    with whole_file(path) as unfinished, unfinished.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load_sampled(path: Path, body: BodyModel) -> SampledTake:
    """Read what `save_sampled` wrote.

    Args:
        path: the file.
        body: of the result.

    Raises:
        InputError: "result-damaged".
    """
    # Damaged bytes fail in a dozen ways in zipfile and numpy.
    with reading(partial(_damaged, path), words=in_words):
        data = read_arrays(path)
        mesh = ObjectMesh(data["vertices"], data["faces"], str(data["object_name"]))
        model = ObjectModel(mesh, *data["size"].tolist())
        chunks = [
            _chunk(bounds, lambda name, n=n: data[f"{name}_{n}"], model)
            for n, bounds in enumerate(data["chunks"].tolist())
        ]
        return SampledTake(chunks, model, body)


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
        "poses": sample.chunk.T_world_object,
        "root": sample.bodies.root.numpy(),
        "rotations": sample.bodies.rotations.numpy(),
        "foot_contact": sample.bodies.foot_contact.numpy(),
        "palms": np.stack([hand.palms for hand in sample.hands]),
        "contact": np.stack([hand.contact for hand in sample.hands]),
        "spans": np.array([(k, s.hand, s.start, s.stop) for k, s in held], int).reshape(-1, 4),
        "anchors": np.array([s.anchor for _, s in held], float).reshape(-1, 3),
    }


def _chunk(
    bounds: list[int], read: Callable[[str], np.ndarray], model: ObjectModel
) -> SampledChunk:
    first, prefix_frames, stop, last = bounds
    poses, spans, anchors = (read(name) for name in ("poses", "spans", "anchors"))
    hands = [HandMotion(*each) for each in zip(read("palms"), read("contact"), strict=True)]
    segments = [
        tuple(
            ContactSegment(hand, start, stop, anchor)
            for (sample, hand, start, stop), anchor in zip(spans.tolist(), anchors, strict=True)
            if sample == k
        )
        for k in range(len(hands))
    ]
    bodies = (torch.from_numpy(read(name)) for name in ("root", "rotations", "foot_contact"))
    return SampledChunk(
        Chunk(first, poses, prefix_frames, stop, bool(last)),
        model.clip(poses),
        hands,
        segments,
        SampledBodies(*bodies),
    )
