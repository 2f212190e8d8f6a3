"""Loading the two stages of a configuration."""

from pathlib import Path

from omomo_core.body.model import load_body
from omomo_core.compute import Device, find_device, quick_in_bf16
from omomo_core.errors import AssetError
from omomo_core.stages import body_capture as body_stage
from omomo_core.stages import hands_capture as hand_stage
from omomo_core.stages.stage import Configuration, Stage, Stages, load_stage

SHIPPED = Path(__file__).parent
_CONDITION_SIZES = {"hands": hand_stage.CONDITION, "body": body_stage.CONDITION}
"""Channels of the condition of the networks of `capture`."""


def load_stages(
    configuration: Configuration = "capture", folder: Path | None = None, device: Device = "cpu"
) -> Stages:
    """The stages in `folder` (as `omocap train` writes them), or those that ship.

    Args:
        configuration: of the stages that ship.
        folder: of other weights.
        device: where the denoisers run; what they take in and give out is on the CPU.

    Raises:
        InputError: "device-missing" where this machine has no such device.
        AssetError: a file is missing, damaged, or of an earlier version of the program. Only `capture`
            weights ship.
    """
    place = find_device(device)
    folder = folder or SHIPPED / configuration
    hands, body = (_checked(folder / f"{name}.safetensors") for name in ("hands", "body"))
    in_bf16 = configuration == "capture" and device == "cpu" and quick_in_bf16(place)
    for stage in (hands, body):
        stage.denoiser.to(place)
        if in_bf16:
            # Two to three times as fast, and what it rounds is a hundredth of the error.
            stage.denoiser.bfloat16()
    return Stages(hands, body, load_body().height)


def _checked(path: Path) -> Stage:
    stage = load_stage(path)
    config = stage.config
    expected = _CONDITION_SIZES.get(config.stage, 0)
    if config.configuration == "capture" and config.denoiser.condition != expected:
        raise AssetError(
            "weights-outdated",
            "These weights were trained with an earlier version of the program: their network has "
            f"{config.denoiser.condition} channels of condition, and this version has {expected}.",
            where=str(path),
            fix="Train them again with ‹omocap train›, or leave out ‹weights› for those that ship.",
        )
    return stage
