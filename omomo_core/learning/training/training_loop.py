"""The training loop: resumable by checkpoints, shared by processes, with averaged weights."""

import copy
import json
import math
import os
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import timedelta
from math import gcd
from pathlib import Path

import torch
from safetensors import safe_open
from safetensors.torch import save_file
from torch import Tensor, distributed, nn
from torch.nn.parallel import DistributedDataParallel

from omomo_core.errors import InputError
from omomo_core.learning.training.corpus import Corpus
from omomo_core.learning.training.training_task import (
    Make,
    Optimiser,
    TrainingTask,
    TrainOptions,
    collate,
)
from omomo_core.stages.network_file import fill_network, save_network
from omomo_core.whole_file import whole_file

SHARDS = 4
"""Parts that a batch is drawn in, each from a seed of its own, so that any number of processes draws the
same batch."""
_TIMEOUT = timedelta(days=7)
"""The first process reads and synthesises the data while the others wait."""


@dataclass(frozen=True)
class ProcessGroup:
    """Rank and number of the processes, and the device of this one."""

    device: torch.device
    rank: int = 0
    count: int = 1

    @property
    def is_main(self) -> bool:
        """Whether this process is the one that writes and reports."""
        return self.rank == 0

    def shards(self, batch: int) -> tuple[Sequence[int], int]:
        """Numbers of the shards of a batch that this process draws, and windows in each.

        Raises:
            InputError: "batch-not-shared" when the processes cannot have equal parts of the batch.
        """
        shards = gcd(batch, SHARDS)
        if shards % self.count:
            shards = self.count
        if batch % shards:
            raise InputError(
                "batch-not-shared",
                f"A batch of {batch} windows cannot be shared equally by {self.count} processes.",
                field="batch",
                fix=f"Use a multiple of {self.count}.",
            )
        return range(self.rank, shards, self.count), batch // shards

    def wrap(self, network: nn.Module) -> nn.Module:
        """Return the network with gradients averaged over the processes; itself when there is one."""
        if self.count == 1:
            return network
        if self.device.type == "cuda":
            network = nn.SyncBatchNorm.convert_sync_batchnorm(network)
            return DistributedDataParallel(network, [self.device.index])
        return DistributedDataParallel(network)

    def mean(self, x: Tensor) -> Tensor:
        """Return the mean of a tensor over the processes, without gradient."""
        if self.count == 1:
            return x.detach()
        total = x.detach().float().clone()
        distributed.all_reduce(total)
        return total / self.count

    def barrier(self) -> None:
        """Wait until every process has called this."""
        if self.count > 1:
            distributed.barrier()


@contextmanager
def process_group() -> Generator[ProcessGroup]:
    """Give the group that torchrun describes in the environment, or a group of this process alone.

    The device is the process's own GPU where there is one, else the CPU.
    """
    count = int(os.environ.get("WORLD_SIZE", "1"))
    rank, local = int(os.environ.get("RANK", "0")), int(os.environ.get("LOCAL_RANK", "0"))
    there = torch.cuda.is_available()
    device = torch.device("cuda", local) if there else torch.device("cpu")
    if count == 1:
        yield ProcessGroup(device)
        return
    if there:
        torch.cuda.set_device(device)
    distributed.init_process_group("nccl" if there else "gloo", timeout=_TIMEOUT)
    try:
        yield ProcessGroup(device, rank, count)
    finally:
        distributed.destroy_process_group()


FALL = 0.4
"""Share of the steps at the end in which the learning rate falls."""


@dataclass
class TrainState:
    """Everything that a resumed run needs."""

    task: TrainingTask
    average: nn.Module
    optimiser: Optimiser
    step: int = 0
    loss: float = math.nan
    seconds: float = 0.0
    """Seconds of CPU that this process has spent on the steps."""


def start(
    make: Make,
    corpus: Corpus,
    options: TrainOptions,
    group: ProcessGroup,
    weights: Path | None = None,
) -> TrainState:
    """A fresh run: statistics from the data, average equal to the weights.

    Args:
        make: gives the untrained network.
        corpus: the clips.
        options: the recipe.
        group: the processes that train together.
        weights: folder of weights to go on from, their statistics included; chance, if not given.

    Raises:
        AssetError, InputError: as `fill_network`.
    """
    torch.manual_seed(options.seed)
    task = make()
    if weights is None:
        task.measure(corpus, options.batch)
    else:
        fill_network(task.network, task.config, weights / f"{task.name}.safetensors")
    task.network.to(group.device)
    average = copy.deepcopy(task.network).eval()
    return TrainState(task, average, Optimiser(task, options.rate))


def train(
    state: TrainState,
    corpus: Corpus,
    options: TrainOptions,
    on_step: Callable[[TrainState], bool],
    group: ProcessGroup,
) -> None:
    """Run until `options.steps`, or until `on_step` (called after every step) returns False.

    Raises:
        InputError: the batch cannot be shared by the processes.
    """
    task, parameters = state.task, list(state.task.network.parameters())
    forward = group.wrap(task.network.train())
    shards, count = group.shards(options.batch)
    smooth = state.loss
    while state.step < options.steps:
        began = time.process_time()
        parts = []
        for shard in shards:
            # Seeded by step and shard, so that a resumed or shared run is the uninterrupted one.
            torch.manual_seed((1_000_003 * options.seed + state.step) * 1_009 + shard)
            parts.append(task.draw(corpus, count))
        loss = task.loss(forward, collate(parts, group.device), options, group.mean)
        value = float(group.mean(loss))
        if math.isfinite(value):
            state.optimiser.step(loss, parameters, _rate(state.step, options))
            _follow(state, options.ema)
            smooth = value if math.isnan(smooth) else 0.99 * smooth + 0.01 * value
        state.step, state.loss = state.step + 1, smooth
        state.seconds += time.process_time() - began
        if not on_step(state):
            break


def _rate(step: int, options: TrainOptions) -> float:
    """Linear warm-up, then full, then linearly down: a run may be given more steps until it falls."""
    falls = options.steps * (1 - FALL)
    down = (options.steps - step) / max(1.0, options.steps - falls)
    return max(0.02, min(1.0, (step + 1) / options.warmup, down))


def _follow(state: TrainState, decay: float) -> None:
    """Move the average towards the weights; early on it follows fast."""
    decay = min(decay, (1 + state.step) / (10 + state.step))
    average, network = state.average, state.task.network
    with torch.no_grad():
        for a, w in zip(average.parameters(), network.parameters(), strict=True):
            a.lerp_(w, 1 - decay)
        # Running statistics are averages already.
        for a, w in zip(average.buffers(), network.buffers(), strict=True):
            a.copy_(w)


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
            fix="Give the ‹size› it was begun with, or another folder with ‹output›.",
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
