"""Checkpoints of a training run, from which it is resumed exactly; without pickle."""

import copy
import json
from dataclasses import asdict
from pathlib import Path

from safetensors import safe_open
from safetensors.torch import save_file
from torch import Tensor, nn

from omomo_core.errors import InputError
from omomo_core.learning.training.distributed import ProcessGroup
from omomo_core.learning.training.loop import TrainState
from omomo_core.learning.training.optimiser import Optimiser
from omomo_core.learning.training.training_task import Make, TrainOptions
from omomo_core.stages.network_file import save_network
from omomo_core.whole_file import whole_file


def save_run(state: TrainState, folder: Path, options: TrainOptions, notes: dict[str, str]) -> None:
    """Write `<network>.safetensors` (the average, to ship) and `<network>.resume` (everything else).

    The first says in its metadata how it was trained: the notes, the recipe, the steps done, windows
    seen, seconds of CPU (of the process that writes) and loss.
    """
    folder.mkdir(parents=True, exist_ok=True)
    name, task = state.task.name, state.task
    metadata = notes | {k: str(v) for k, v in asdict(options).items()}
    metadata |= {"steps_done": str(state.step), "windows_seen": str(state.step * options.batch)}
    metadata |= {"cpu_seconds": f"{state.seconds:.1f}", "loss": f"{state.loss:.5f}"}
    with whole_file(folder / f"{name}.safetensors") as weights:
        save_network(state.average, task.config, weights, metadata)
    tensors = _tensors("weights", task.network) | _tensors("average", state.average)
    tensors |= {f"optimiser.{k}": v for k, v in state.optimiser.tensors().items()}
    progress = {
        "config": json.dumps(asdict(task.config)),
        "step": str(state.step),
        "loss": repr(state.loss),
        "seconds": repr(state.seconds),
    }
    with whole_file(folder / f"{name}.resume") as rest:
        save_file(tensors, rest, progress)


def resume_run(
    make: Make, folder: Path, options: TrainOptions, group: ProcessGroup
) -> TrainState | None:
    """The state `save_run` left in the folder, or None when there is none.

    Raises:
        InputError: "run-differs" when the folder holds a run of another network or size.
    """
    task = make()
    path = folder / f"{task.name}.resume"
    if not path.is_file():
        return None
    with safe_open(path, framework="pt") as file:
        progress: dict[str, str] = file.metadata()
        tensors = {k: file.get_tensor(k) for k in file.keys()}  # noqa: SIM118
    config = json.dumps(asdict(task.config))
    if progress.get("config", config) != config:
        raise InputError(
            "run-differs",
            f"This folder holds a run of another method, size or version: {path.name} has other sizes.",
            where=str(folder),
            fix="Give the --size it was begun with, or another folder with -o.",
        )
    task.network.load_state_dict(_part(tensors, "weights."))
    task.network.to(group.device)
    average = copy.deepcopy(task.network).eval()
    average.load_state_dict(_part(tensors, "average."))
    optimiser = Optimiser(task, options.rate)
    optimiser.load(_part(tensors, "optimiser."))
    step, loss = int(progress["step"]), float(progress["loss"])
    return TrainState(task, average, optimiser, step, loss, float(progress.get("seconds", "0")))


def _tensors(prefix: str, module: nn.Module) -> dict[str, Tensor]:
    return {f"{prefix}.{k}": v.contiguous() for k, v in module.state_dict().items()}


def _part(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {k.removeprefix(prefix): v for k, v in tensors.items() if k.startswith(prefix)}
