"""Files of networks: small, near to what was saved, and readable in both forms there have been."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.torch import save_file
from torch import nn

from omomo_core.stages.network_file import fill_network, load_network, read_header, save_network


@dataclass(frozen=True)
class Config:
    """Of the network below."""

    width: int = 64


class Network(nn.Module):
    """A matrix, a vector and a measured number."""

    mean: torch.Tensor

    def __init__(self, config: Config) -> None:
        super().__init__()
        self.linear = nn.Linear(config.width, config.width)
        self.register_buffer("mean", torch.randn(3))


@given(seed=st.integers(0, 999), size=st.floats(1e-6, 1e4))
@settings(max_examples=20)
def test_every_number_comes_back_within_its_rounding(
    seed: int, size: float, tmp_path_factory: pytest.TempPathFactory
):
    torch.manual_seed(seed)
    network, path = Network(Config()), tmp_path_factory.mktemp("file") / "n.safetensors"
    with torch.no_grad():
        network.linear.weight *= size * 10 ** torch.randn(64, 1)
        network.linear.weight[3] = 0.0
    save_network(network, Config(), path, {})
    again = load_network(path, lambda told: Network(Config(**told)))
    step = network.linear.weight.abs().amax(dim=1, keepdim=True) / 127
    apart = (again.linear.weight - network.linear.weight).abs()
    assert bool((apart <= 0.501 * step + 1e-12).all())
    torch.testing.assert_close(again.linear.bias, network.linear.bias, rtol=1e-3, atol=1e-4)
    torch.testing.assert_close(again.mean, network.mean, rtol=0, atol=0)


def test_a_file_saved_again_says_the_same(tmp_path: Path):
    first, second = tmp_path / "a.safetensors", tmp_path / "b.safetensors"
    save_network(Network(Config()), Config(), first, {"steps": "5"})
    save_network(load_network(first, lambda told: Network(Config(**told))), Config(), second, {})
    one, two = Network(Config()), Network(Config())
    fill_network(one, Config(), first)
    fill_network(two, Config(), second)
    torch.testing.assert_close(one.state_dict(), two.state_dict(), rtol=1e-6, atol=0)


def test_the_header_counts_what_was_learnt_or_measured(tmp_path: Path):
    path = tmp_path / "n.safetensors"
    network = Network(Config(512))
    save_network(network, Config(512), path, {"steps": "5"})
    header = read_header(path)
    assert header.parameters == sum(v.numel() for v in network.state_dict().values())
    assert header.notes == {"steps": "5"}
    assert header.name == f"{tmp_path.name}/n"
    assert path.stat().st_size < 1.1 * header.parameters


def test_files_in_half_precision_are_read(tmp_path: Path):
    path, network = tmp_path / "n.safetensors", Network(Config())
    half = {k: v.half() for k, v in network.state_dict().items()}
    save_file(half, path, {"config": json.dumps(asdict(Config()))})
    again = load_network(path, lambda told: Network(Config(**told)))
    torch.testing.assert_close(again.state_dict(), network.state_dict(), rtol=1e-3, atol=1e-4)
