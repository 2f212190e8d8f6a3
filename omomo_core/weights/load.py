"""Loading the two stages of a configuration."""

from pathlib import Path

import torch

from omomo_core.body.load import load_body
from omomo_core.generation.result import Stages
from omomo_core.stage import Configuration, load_stage

SHIPPED = Path(__file__).parent


def load_stages(configuration: Configuration = "capture", folder: Path | None = None) -> Stages:
    """The stages in `folder` (as `omocap train` writes them), or those that ship.

    Raises:
        AssetError: a file is missing or damaged. Only `capture` weights ship.
    """
    folder = folder or SHIPPED / configuration
    hands, body = (load_stage(folder / f"{name}.safetensors") for name in ("hands", "body"))
    if configuration == "capture" and torch.cpu.get_capabilities().get("amx_bf16", False):
        # Matrix units make it three times as fast, and what it rounds is a hundredth of the error.
        for stage in (hands, body):
            stage.denoiser.bfloat16()
    return Stages(hands, body, load_body().height)
