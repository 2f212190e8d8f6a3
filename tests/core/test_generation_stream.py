"""Takes of any length: chapters, seams, poses that still arrive."""

from collections.abc import Iterator

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.body.model import load_body
from omomo_core.generation.generation_config import LIVE, RECORDED, ChunkSizes
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.generation.person import join
from omomo_core.generation.sample_chunks import split_into_chunks
from omomo_core.generation.stream import GeneratedChunk, stream
from omomo_core.stages.stage import Stages
from omomo_core.weights.load import load_stages
from tests.core.test_generation import carried, untrained

BODY = load_body()
SHORT = ChunkSizes(length=150, context=30, margin=20, spare=30)


def quiet(name: str, done: float) -> None:
    """Nobody listens."""


@given(
    frames=st.integers(1, 900),
    context=st.integers(1, 60),
    margin=st.integers(0, 40),
    spare=st.integers(0, 120),
)
@settings(max_examples=60)
def test_every_frame_is_decided_once(frames: int, context: int, margin: int, spare: int):
    poses = np.tile(np.eye(4), (frames, 1, 1))
    poses[:, 0, 3] = np.arange(frames)
    prefix: list[float] = []
    how = ChunkSizes(150, context, margin, spare)
    for chunk in split_into_chunks(iter(poses), how):
        own = chunk.T_world_object[chunk.prefix_frames : chunk.stop, 0, 3]
        assert own[0] == chunk.first + chunk.prefix_frames
        assert len(chunk.T_world_object) <= how.length + how.spare
        prefix += own.tolist()
    assert prefix == list(range(frames))
    assert chunk.last


def blocks(frames: int, how: ChunkSizes, stages: Stages | None = None) -> list[GeneratedChunk]:
    options, motion = GenerationOptions(samples=2, steps=4), carried(frames)
    made = stream(
        motion.mesh, motion.T_world_object, BODY, stages or untrained(), options, quiet,
        chunk_sizes=how,
    )  # fmt: skip
    return list(made)


def test_the_generator_is_its_stream_put_together():
    whole = generate(carried(200), BODY, untrained(), GenerationOptions(samples=2, steps=4), quiet)
    parts = blocks(200, RECORDED)
    for k in range(2):
        person = join([b.people[k] for b in parts])
        np.testing.assert_array_equal(person.human.joints, whole.motions[k].joints)
        assert len(person.segments) == len(whole.people[k].segments)


@pytest.mark.parametrize(("how", "frames"), [(SHORT, 320), (LIVE, 180)])
def test_no_seam_is_seen_where_chapters_meet(how: ChunkSizes, frames: int):
    made = blocks(frames, how, load_stages())
    assert len(made) > 2
    for k in range(2):
        joints = join([b.people[k] for b in made]).human.joints
        jump = np.linalg.norm(np.diff(joints, axis=0), axis=-1).max(axis=1)
        seams = [b.first - 1 for b in made[1:]]
        assert jump[seams].max() <= 1.3 * np.quantile(np.delete(jump, seams), 0.98) + 0.01


def test_holding_palms_stay_on_their_places_across_chapters():
    for person in blocks(320, SHORT)[2].people:
        for s in person.segments:
            assert person.human.hand_contact[s.start : s.stop, s.hand].min() > 0.99


def test_live_motion_is_never_more_than_two_seconds_behind_the_poses():
    motion, seen = carried(220), 0

    def arriving() -> Iterator[np.ndarray]:
        nonlocal seen
        for pose in motion.T_world_object:
            seen += 1
            yield pose

    done, options = 0, GenerationOptions(samples=1, steps=2)
    for block in stream(
        motion.mesh, arriving(), BODY, untrained(), options, quiet, chunk_sizes=LIVE
    ):
        assert seen - done <= 121
        assert block.first == done
        done += len(block.must_hold)
        assert seen - done <= 60
    assert done == 220


def test_memory_does_not_grow_with_the_take():
    held: list[int] = []
    motion = carried(60)

    def poses() -> Iterator[np.ndarray]:
        for frame in range(600):
            yield motion.T_world_object[min(frame, 59)]

    options = GenerationOptions(samples=1, steps=2)
    for block in stream(motion.mesh, poses(), BODY, untrained(), options, quiet, chunk_sizes=SHORT):
        held.append(len(block.must_hold))
    # Stretches are of one length, whatever came before.
    assert max(held) <= SHORT.length + SHORT.spare
    assert sum(held) == 600
    assert len(held) > 4
    assert torch.is_grad_enabled()
