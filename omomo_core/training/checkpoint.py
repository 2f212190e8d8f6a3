"""Saving a run so that it can be resumed exactly, without pickle."""

from dataclasses import asdict
from pathlib import Path

import torch
from safetensors import safe_open
from safetensors.torch import save_file
from torch import Tensor

from omomo_core.stage import Stage, StageConfig, save_stage
from omomo_core.training.loop import TrainOptions, TrainState
from omomo_core.training.optimiser import Optimiser
from omomo_core.whole_file import whole_file


def save_run(state: TrainState, folder: Path, options: TrainOptions, notes: dict[str, str]) -> None:
    """Write `<stage>.safetensors` (the average, to ship) and `<stage>.resume` (everything else)."""
    folder.mkdir(parents=True, exist_ok=True)
    name = state.stage.config.stage
    recipe = {k: str(v) for k, v in asdict(options).items()}
    notes = {**notes, **recipe, "steps_done": str(state.step), "loss": f"{state.loss:.5f}"}
    with whole_file(folder / f"{name}.safetensors") as weights:
        save_stage(state.average, weights, notes)
    tensors = _tensors("weights", state.stage) | _tensors("average", state.average)
    tensors |= {f"optimiser.{k}": v for k, v in state.optimiser.tensors().items()}
    progress = {"step": str(state.step), "loss": repr(state.loss)}
    with whole_file(folder / f"{name}.resume") as rest:
        save_file(tensors, rest, progress)


def resume_run(config: StageConfig, folder: Path, options: TrainOptions) -> TrainState | None:
    """The state `save_run` left in the folder, or None when there is none."""
    path = folder / f"{config.stage}.resume"
    if not path.is_file():
        return None
    with safe_open(path, framework="pt") as file:
        progress = file.metadata()
        tensors = {k: file.get_tensor(k) for k in file.keys()}  # noqa: SIM118
    stage, average = Stage(config), Stage(config)
    stage.load_state_dict(_part(tensors, "weights."))
    average.load_state_dict(_part(tensors, "average."))
    optimiser = Optimiser(stage, options.rate)
    optimiser.load(_part(tensors, "optimiser."))
    return TrainState(
        stage, average.eval(), optimiser, int(progress["step"]), float(progress["loss"])
    )


def _tensors(prefix: str, module: torch.nn.Module) -> dict[str, Tensor]:
    return {f"{prefix}.{k}": v.contiguous() for k, v in module.state_dict().items()}


def _part(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {k.removeprefix(prefix): v for k, v in tensors.items() if k.startswith(prefix)}
