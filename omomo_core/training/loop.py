"""The training loop of one stage: resumable, with an exponential moving average of the weights."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.body_stage import capture as body_capture
from omomo_core.body_stage import paper as body_paper
from omomo_core.diffusion.schedule import LEVELS, cosine_schedule, shifted
from omomo_core.stage import Stage, StageConfig, StageName
from omomo_core.training.corpus import Corpus
from omomo_core.training.examples import Example, make_example
from omomo_core.training.optimiser import Optimiser

SHIPPED_STEPS: dict[StageName, int] = {"hands": 20_000, "body": 9_000}
"""Of the weights that ship; with more time, more is better."""
STATISTICS_BATCHES = 8
FALL = 0.4
"""Share of the steps at the end in which the learning rate falls."""


@dataclass(frozen=True)
class TrainOptions:
    """The recipe."""

    steps: int
    batch: int = 64
    rate: float = 1e-3
    warmup: int = 200
    ema: float = 0.999
    velocity: float = 1.0
    """Weight of the L1 loss on frame-to-frame differences (capture configuration)."""
    feet: float = 20.0
    """Weight of the L1 error of the feet's steps in the world, metres a frame (capture body stage):
    root and feet err little each, and together they glide."""
    seed: int = 0


@dataclass
class TrainState:
    """Everything that a resumed run needs."""

    stage: Stage
    average: Stage
    optimiser: Optimiser
    step: int = 0
    loss: float = math.nan


def start(config: StageConfig, corpus: Corpus, options: TrainOptions) -> TrainState:
    """A fresh run: statistics from the data, average equal to the weights."""
    torch.manual_seed(options.seed)
    stage = Stage(config)
    _measure_statistics(stage, corpus, options.batch)
    average = Stage(config)
    average.load_state_dict(stage.state_dict())
    return TrainState(stage, average.eval(), Optimiser(stage, options.rate))


def train(
    state: TrainState,
    corpus: Corpus,
    options: TrainOptions,
    on_step: Callable[[TrainState], bool],
    device: torch.device,
) -> None:
    """Run until `options.steps`, or until `on_step` (called after every step) returns False."""
    schedule = cosine_schedule()
    state.stage.train()
    smooth = state.loss
    while state.step < options.steps:
        # Seeded by the step, so that a resumed run is the uninterrupted one.
        torch.manual_seed(1_000_003 * options.seed + state.step)
        loss = _step(state.stage, corpus, options, schedule.add_noise, device)
        if math.isfinite(loss.item()):
            state.optimiser.step(loss, list(state.stage.parameters()), _rate(state.step, options))
            _follow(state, options.ema)
            smooth = loss.item() if math.isnan(smooth) else 0.99 * smooth + 0.01 * loss.item()
        state.step, state.loss = state.step + 1, smooth
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
    with torch.no_grad():
        for a, w in zip(state.average.parameters(), state.stage.parameters(), strict=True):
            a.lerp_(w, 1 - decay)


def _draw(stage: Stage, corpus: Corpus, batch: int) -> Example:
    c = stage.config
    points = c.denoiser.shape // 3
    windows = corpus.draw(batch, points, objects_only=c.stage == "hands")
    return make_example(c, windows)


def _step(
    stage: Stage,
    corpus: Corpus,
    options: TrainOptions,
    add_noise: Callable[[Tensor, Tensor, Tensor], Tensor],
    device: torch.device,
) -> Float[Tensor, ""]:
    example = _draw(stage, corpus, options.batch)
    x0 = stage.normalise(example.x0.to(device))
    condition, shape = example.condition.to(device), example.shape
    if stage.config.stage == "body" and stage.config.configuration == "paper":
        condition = body_paper.condition(
            x0[..., body_paper.POSITIONS - 6 : body_paper.POSITIONS].cpu()
        ).to(device)
    share = shifted(torch.rand(len(x0)), stage.config.level_shift)
    level = (share * (LEVELS - 1)).round().long()
    x_n = add_noise(x0.cpu(), level, torch.randn(x0.shape)).to(device)
    with torch.autocast(device.type, torch.bfloat16):
        guess = stage(
            x_n,
            condition,
            None if shape is None else shape.to(device),
            level.to(device),
            example.valid.to(device),
        )
    valid = example.valid.to(device)
    if stage.config.configuration == "paper":
        # The paper divides by all frames, padding included, and has no other term.
        return ((guess.float() - x0).abs() * valid[..., None]).mean()
    return _loss(stage, guess.float() - x0, valid, options)


def _loss(
    stage: Stage,
    error: Float[Tensor, "b frames channels"],
    valid: Bool[Tensor, "b frames"],
    options: TrainOptions,
) -> Float[Tensor, ""]:
    """L1 on x0, on its change from frame to frame, and on the feet's."""
    both = (valid[:, 1:] & valid[:, :-1])[..., None]

    def change(x: Tensor) -> Tensor:
        return (x.diff(dim=1).abs() * both).sum() / (both.sum() * x.shape[-1])

    loss = (error.abs() * valid[..., None]).sum() / (valid.sum() * error.shape[-1])
    loss = loss + options.velocity * change(error)
    if stage.config.stage == "body":
        loss = loss + options.feet * change(body_capture.feet(error * stage.x_std))
    return loss


def _measure_statistics(stage: Stage, corpus: Corpus, batch: int) -> None:
    """Set the statistics that put features on one scale."""
    examples = [_draw(stage, corpus, batch) for _ in range(STATISTICS_BATCHES)]
    x = torch.cat([e.x0[e.valid] for e in examples])
    if stage.config.configuration == "paper":
        # Min-max to [-1, 1] for positions; rotations and conditions enter as they are.
        count = min(body_paper.POSITIONS, x.shape[-1])
        low, high = x.amin(dim=0)[:count], x.amax(dim=0)[:count]
        stage.x_mean[:count] = (low + high) / 2
        stage.x_std[:count] = ((high - low) / 2).clamp(min=1e-3)
        return
    c = torch.cat([e.condition[e.valid] for e in examples])
    stage.x_mean.copy_(x.mean(dim=0))
    stage.x_std.copy_(x.std(dim=0).clamp(min=1e-3))
    stage.c_mean.copy_(c.mean(dim=0))
    stage.c_std.copy_(c.std(dim=0).clamp(min=0.1))
