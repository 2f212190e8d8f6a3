"""Scenes for the tests of replay: results of somebody who carries a box, and a reader of packs."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from capture_app.manifest import BodyRecord, FloorRecord, Input, Manifest, Segment, sha256
from capture_app.replay.scene_pack import pack_result
from capture_app.result import Result
from omomo_core.contact.segment import ContactSegment as Contact
from omomo_core.generation.person import Person
from omomo_core.motion import HumanMotion, ObjectMotion
from tests.capture_app.comparison.conftest import carrying

FRAMES = 40
DTYPES = {"f4": "<f4", "i2": "<i2", "i1": "i1", "u1": "u1", "u2": "<u2", "u4": "<u4"}


def read_pack(data: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """A scene pack as docs/replay.md lays it out."""
    length = struct.unpack_from("<I", data)[0]
    header = json.loads(data[4 : 4 + length])
    first = (4 + length + 7) // 8 * 8
    arrays: dict[str, np.ndarray] = {}
    for name, told in header["arrays"].items():
        start = first + told["offset"]
        assert start % 8 == 0
        count = int(np.prod(told["shape"]))
        flat = np.frombuffer(data, DTYPES[told["dtype"]], count, start)
        arrays[name] = flat.reshape(told["shape"])
    return header, arrays


def person(aside: float, first: int) -> tuple[Person, ObjectMotion]:
    """Who carries the box from frame `first` to 30 in both hands; `aside` is how far from it."""
    motion = carrying(aside=aside, frames=FRAMES)
    moved = motion.object_motion
    palms = motion.human.joints[:, 22:]
    T = moved.T_world_object
    local = np.einsum("fji,fpj->fpi", T[:, :3, :3], palms - T[:, None, :3, 3])
    held = tuple(Contact(hand, first, 30, local[first, hand]) for hand in (0, 1))
    miss = np.tile(np.linspace(0, 0.02, FRAMES)[:, None], (1, 2))
    return Person(motion.human, held, miss, np.full(FRAMES, 0.01)), moved


def make_result(folder: Path, inputs: tuple[Input, ...] = (), **options: Any) -> Result:
    """Two samples: the second stands 12 cm aside, and holds later."""
    samples = [person(0.0, 5), person(0.12, 10)]
    manifest = Manifest(
        inputs=inputs,
        options={"animated": not inputs, **options},
        segment=Segment(index=1, count=1, start=15 if inputs else 0, stop=FRAMES + 15),
        floor=FloorRecord(height=0.0, source="given"),
        mount_method="none",
        body=BodyRecord(name="anny", credit="CC0", height=1.72),
        weights={},
        scores=({"total": 1.0}, {"total": 2.0}),
        chosen=0,
        notes=("The floor is a guess.",),
        faults=(),
        timings={},
        files=(),
    )
    moved = samples[0][1]
    placed = ObjectMotion(moved.mesh, moved.T_world_object, moved.valid, 0.5 if inputs else 0.0)
    return Result(folder, manifest, tuple(sample for sample, _ in samples), placed)


def input_of(role: Any, path: Path) -> Input:
    return Input(role=role, path=str(path), sha256=sha256(path))


def human_of(result: Result, sample: int = 0) -> HumanMotion:
    return result.people[sample].human


def pack_of(folder: Path) -> bytes:
    return pack_result(make_result(folder))
