"""Work that threads do side by side, and networks in less precision: faster, and the same people."""

import threading
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from omomo_core.body.model import load_body
from omomo_core.compute import LEAST_WINDOWS, batch_parts, sample_groups, torch_threads
from omomo_core.generation.generation_config import ChunkSizes
from omomo_core.generation.generation_options import GenerationOptions, no_progress
from omomo_core.generation.stream import one_ahead, stream
from omomo_core.stages.stage import Stage, StageConfig, load_stage
from omomo_core.weights.load import SHIPPED, load_stages
from tests.core.test_generation import carried


@pytest.fixture
def two_threads() -> Generator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    yield
    torch.set_num_threads(before)


@pytest.mark.usefixtures("two_threads")
def test_threads_come_back_after_an_error():
    with pytest.raises(KeyboardInterrupt), torch_threads(1):
        raise KeyboardInterrupt
    assert torch.get_num_threads() == 2
    with torch_threads(1):
        assert torch.get_num_threads() == 1


@given(windows=st.integers(1, 400), threads=st.integers(1, 9))
def test_parts_of_a_batch_are_never_small_where_it_is_not(windows: int, threads: int):
    parts = batch_parts(windows, 64, threads)
    assert [i for part in parts for i in range(part.start, part.stop)] == list(range(windows))
    for part in parts:
        size = part.stop - part.start
        assert LEAST_WINDOWS <= size <= 64 or part.start % 64 == 0


def test_samples_are_solved_side_by_side_where_that_changes_nothing():
    assert sample_groups(4, 600, 2) == [slice(0, 2), slice(2, 4)]
    assert sample_groups(4, 600, 8) == [slice(0, 2), slice(2, 4)]
    assert sample_groups(3, 600, 2) == [slice(0, 3)]
    assert sample_groups(4, 348, 2) == [slice(0, 4)]
    assert sample_groups(1, 600, 2) == [slice(0, 1)]


@pytest.mark.parametrize("frames", [200, 260])
def test_the_number_of_threads_changes_nothing_but_last_bits(frames: int):
    """Of one chunk, and of two that are made side by side."""
    made: list[list[np.ndarray]] = []
    before, options = torch.get_num_threads(), GenerationOptions(samples=4, steps=3)
    sizes = ChunkSizes(length=160, context=30, margin=20, spare=60)
    motion, stages, body = carried(frames), load_stages(), load_body()
    for threads in (1, 2):
        torch.set_num_threads(threads)
        chunks = stream(
            motion.mesh, motion.T_world_object, body, stages, options, chunk_sizes=sizes,
            complete=True,
        )  # fmt: skip
        made.append([p.human.joints for chunk in chunks for p in chunk.people])
        assert torch.get_num_threads() == threads
        assert threads_of_a_new_thread() == threads
    torch.set_num_threads(before)
    for one, two in zip(*made, strict=True):
        np.testing.assert_allclose(one, two, rtol=0.0, atol=1e-5)


def threads_of_a_new_thread() -> int:
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(torch.get_num_threads).result()


def counted(told: Callable[[str, float], None]) -> Iterator[int]:
    for k in range(1, 9):
        told("count", k / 8)
        yield k


def test_the_next_item_is_made_meanwhile_and_none_is_left_out():
    assert list(one_ahead(counted, no_progress)) == list(range(1, 9))


def test_what_goes_wrong_in_the_other_thread_is_told_in_the_item_s_place():
    def stop(step: str, done: float) -> None:
        if done > 0.3:
            raise KeyboardInterrupt

    seen: list[int] = []
    with pytest.raises(KeyboardInterrupt):
        seen.extend(iter(one_ahead(counted, stop)))
    assert seen == [1, 2]


def test_whoever_goes_away_leaves_no_thread():
    before = threading.active_count()
    items = one_ahead(counted, no_progress)
    assert next(items) == 1
    items.close()
    assert threading.active_count() == before


def said_by(stage: Stage) -> torch.Tensor:
    config: StageConfig = stage.config
    noise = torch.Generator().manual_seed(1)
    channels, condition = config.denoiser.channels, config.denoiser.condition
    x = torch.randn(2, 120, channels, generator=noise)
    told = torch.randn(2, 120, condition, generator=noise)
    code = torch.randn(2, 1, config.denoiser.shape, generator=noise)
    with torch.inference_mode():
        return stage(x, told, code, torch.tensor([900, 300]), torch.ones(2, 120, dtype=torch.bool))


@pytest.mark.parametrize("name", ["hands", "body"])
def test_bf16_rounds_what_a_network_says_by_little(name: str):
    stage = load_stage(SHIPPED / "capture" / f"{name}.safetensors")
    exact = said_by(stage)
    stage.denoiser.bfloat16()
    rounded = said_by(stage)
    assert rounded.dtype == torch.float32
    off = float((rounded - exact).abs().mean())
    assert 0 < off < 0.05 * float(exact.std())
    assert np.isfinite(rounded.numpy()).all()
