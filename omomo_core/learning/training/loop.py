"""The training loop of one network: resumable, shared by processes, with an average of the weights."""

import copy
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import nn

from omomo_core.learning.training.corpus import Corpus
from omomo_core.learning.training.distributed import ProcessGroup
from omomo_core.learning.training.optimiser import Optimiser
from omomo_core.learning.training.training_task import Make, TrainingTask, TrainOptions, collate
from omomo_core.stages.network_file import fill_network

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
    """Of CPU that this process has spent on the steps."""


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
