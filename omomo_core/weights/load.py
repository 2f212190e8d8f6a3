"""Loading the two stages of a configuration."""

from pathlib import Path

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
    return Stages(
        hands=load_stage(folder / "hands.safetensors"),
        body=load_stage(folder / "body.safetensors"),
        height=load_body().height,
    )
