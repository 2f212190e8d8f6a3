"""The devices on which networks can run, and whether this machine has them."""

from typing import Literal

import torch

from omomo_core.errors import InputError

Device = Literal["cpu", "cuda", "mps"]


def find_device(name: Device) -> torch.device:
    """Return the device of that name.

    Raises:
        InputError: "device-missing" where PyTorch finds none on this machine.
    """
    if not _is_there(name):
        raise InputError(
            "device-missing",
            f"PyTorch {torch.__version__} finds no device {name} on this machine.",
            where=f"--device {name}",
            fix="Run on the processor (--device cpu), or install the driver of the graphics card and "
            "the build of PyTorch for it (docs/platforms.md).",
        )
    return torch.device(name)


def _is_there(name: Device) -> bool:
    if name == "cuda":
        return torch.cuda.is_available()
    return name == "cpu" or torch.backends.mps.is_available()
