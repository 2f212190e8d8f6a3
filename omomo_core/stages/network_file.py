"""The file of a trained network: safetensors, with its configuration and how it was trained inside.

Matrices are kept at eight bits a number: each row as whole numbers up to 127 and, under the name of the
matrix with `.row_scale` after it, what one of them is worth. Other parameters are in half precision, and
buffers as they are.
"""

import hashlib
import json
import math
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import torch
from jaxtyping import Float, Int8
from safetensors import safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

from omomo_core.errors import AssetError, InputError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Network = TypeVar("Network", bound=nn.Module)

_SCALE = ".row_scale"
_LARGEST = 127


def save_network(
    network: nn.Module, config: "DataclassInstance", path: Path, notes: dict[str, str]
) -> None:
    """Write parameters and buffers with configuration and notes inside."""
    learnt = {name for name, _ in network.named_parameters()}
    tensors: dict[str, Tensor] = {}
    for name, value in network.state_dict().items():
        if name in learnt and value.dim() == 2:
            tensors[name], tensors[name + _SCALE] = _eight_bits(value)
        else:
            tensors[name] = (value.half() if name in learnt else value).contiguous()
    save_file(tensors, path, {"config": json.dumps(asdict(config)), **notes})


def _eight_bits(
    matrix: Float[Tensor, "rows columns"],
) -> tuple[Int8[Tensor, "rows columns"], Float[Tensor, "rows 1"]]:
    """Whole numbers, and what one of each row is worth."""
    scale = (matrix.float().abs().amax(1, keepdim=True) / _LARGEST).clamp_min(1e-12)
    return (matrix / scale).round().to(torch.int8).contiguous(), scale


def load_network(path: Path, build: Callable[[dict[str, Any]], Network]) -> Network:
    """Read what `save_network` wrote, in evaluation mode.

    Args:
        path: the file.
        build: an untrained network from the configuration as JSON holds it.

    Raises:
        AssetError: missing, damaged, or not one of our files.
    """
    _check_there(path)
    with _readable(path), safe_open(path, framework="pt") as file:
        network = build(json.loads(file.metadata()["config"]))
        # Copied into the network's own precision.
        network.load_state_dict(_tensors(file))
    return network.eval()


def fill_network(network: nn.Module, config: "DataclassInstance", path: Path) -> None:
    """Give a network the numbers of a file.

    Args:
        network: changed.
        config: what it was built from.
        path: a file that `save_network` wrote.

    Raises:
        AssetError: missing, damaged, or not one of our files.
        InputError: ``other-network`` when the file holds a network of another method, size or version.
    """
    _check_there(path)
    with _readable(path), safe_open(path, framework="pt") as file:
        theirs, tensors = json.loads(file.metadata()["config"]), _tensors(file)
    if theirs != json.loads(json.dumps(asdict(config))):
        raise InputError(
            "other-network",
            "These weights are of a network of another method, size or version of the program.",
            where=str(path),
            fix="Give weights that were trained with the same METHOD and ‹size›.",
        )
    network.load_state_dict(tensors)


def _tensors(file: Any) -> dict[str, Tensor]:
    tensors = {k: file.get_tensor(k) for k in file.keys()}  # noqa: SIM118
    return {
        k: tensors[k] * tensors[k + _SCALE] if k + _SCALE in tensors else tensors[k]
        for k in _names(file)
    }


def _names(file: Any) -> list[str]:
    return [k for k in file.keys() if not k.endswith(_SCALE)]  # noqa: SIM118


def _check_there(path: Path) -> None:
    if not path.is_file():
        raise AssetError(
            "weights-missing",
            f"There are no weights for this network: {path.name} is not there.",
            where=str(path),
            fix="Train them with ‹omocap train›, or reinstall the program.",
        )


@dataclass(frozen=True)
class Header:
    """The file of a network: its name and digest, and what it says of itself."""

    name: str
    """The file with its folder, without its ending."""
    digest: str
    notes: dict[str, str]
    """The training notes that `save_network` was given."""
    parameters: int
    """Numbers that were learnt or measured."""


def read_header(path: Path) -> Header:
    """What a file says, without its numbers.

    Raises:
        AssetError: missing, damaged, or not one of our files.
    """
    _check_there(path)
    with _readable(path), safe_open(path, framework="pt") as file:
        sizes = [file.get_slice(key).get_shape() for key in _names(file)]
        # In files they stand in no order.
        notes = {k: v for k, v in sorted(file.metadata().items()) if k != "config"}
    digest = hashlib.sha256(path.read_bytes()).hexdigest()[:12]
    parameters = sum(math.prod(size) for size in sizes)
    return Header(f"{path.parent.name}/{path.stem}", digest, notes, parameters)


def digest_of(networks: Sequence[Header]) -> str:
    """One digest for all networks of a method; "" when it has none."""
    text = " ".join(network.digest for network in networks)
    return hashlib.sha256(text.encode()).hexdigest()[:16] if networks else ""


@contextmanager
def _readable(path: Path) -> Generator[None]:
    try:
        yield
    except Exception as error:
        raise AssetError(
            "weights-damaged",
            "The weights file cannot be read.",
            where=str(path),
            fix="Restore the file, or train it again with ‹omocap train›.",
        ) from error
