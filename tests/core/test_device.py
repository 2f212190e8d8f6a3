"""The networks on another device: all of them, and nothing else, is there."""

import numpy as np
import pytest
import torch

from omomo_core.compute import find_device
from omomo_core.errors import InputError
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.stages.stage import Stage
from omomo_core.weights.load import load_stages
from tests.core.test_generation import BODY, carried
from tests.core.test_generation_threads import said_by

needs_cuda = pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no CUDA device")


@pytest.fixture
def no_graphics_card(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    monkeypatch.setattr(torch.backends.mps, "is_available", lambda: False)


@pytest.mark.usefixtures("no_graphics_card")
def test_the_processor_is_always_there():
    assert find_device("cpu") == torch.device("cpu")


@pytest.mark.usefixtures("no_graphics_card")
@pytest.mark.parametrize("name", ["cuda", "mps"])
def test_a_device_that_is_not_there_is_refused(name: str):
    with pytest.raises(InputError) as refused:
        load_stages("capture", device=name)  # type: ignore[arg-type]
    assert refused.value.code == "device-missing"
    assert refused.value.where == f"‹device› {name}"
    assert "‹device› cpu" in refused.value.fix


@pytest.mark.parametrize("name", ["hands", "body"])
def test_all_that_a_denoiser_takes_in_goes_to_its_device(name: str):
    stage: Stage = getattr(load_stages(), name)
    stage.denoiser.to("meta")
    # A tensor that stayed behind would be refused in the middle. The device "meta" computes nothing,
    # so only the way back cannot be gone.
    with pytest.raises(NotImplementedError, match="Cannot copy out of meta tensor"):
        said_by(stage)


@needs_cuda
@pytest.mark.parametrize("name", ["hands", "body"])
def test_a_network_says_nearly_the_same_on_cuda(name: str):
    here, there = (getattr(load_stages(device=d), name) for d in ("cpu", "cuda"))
    here.denoiser.float()
    said, answer = said_by(here), said_by(there)
    assert answer.device.type == "cpu"
    torch.testing.assert_close(answer, said, atol=1e-3, rtol=1e-3)


@needs_cuda
def test_the_same_seed_gives_the_same_people_on_cuda():
    def made() -> np.ndarray:
        options = GenerationOptions(samples=2, steps=4)
        people = generate(carried(150), BODY, load_stages(device="cuda"), options).motions
        return np.stack([person.joints for person in people])

    first = made()
    assert np.isfinite(first).all()
    np.testing.assert_array_equal(first, made())
