"""One thread for little work, and networks in less precision: faster, and the same people."""

from collections.abc import Generator

import numpy as np
import pytest
import torch

from omomo_core.generation.threads import threads_for
from omomo_core.stages.stage import Stage, StageConfig, load_stage
from omomo_core.weights.load import SHIPPED


@pytest.fixture
def two_threads() -> Generator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    yield
    torch.set_num_threads(before)


@pytest.mark.usefixtures("two_threads")
@pytest.mark.parametrize(("frames", "count"), [(1, 1), (300, 1), (301, 2)])
def test_little_work_is_done_by_one_thread(frames: int, count: int):
    with threads_for(frames, little=300, most=2):
        assert torch.get_num_threads() == count
    assert torch.get_num_threads() == 2


@pytest.mark.usefixtures("two_threads")
def test_threads_come_back_after_an_error():
    with pytest.raises(KeyboardInterrupt), threads_for(1, little=300, most=2):
        raise KeyboardInterrupt
    assert torch.get_num_threads() == 2


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
