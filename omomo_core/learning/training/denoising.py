"""The training task of a diffusion stage: windows, their inputs, noise and loss."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import lru_cache

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn
from torch.nn.attention import SDPBackend, sdpa_kernel

from omomo_core.compute import quick_in_bf16
from omomo_core.diffusion.samplers import LEVELS, Schedule, cosine_schedule, shifted
from omomo_core.geometry.rotations import human_frame, rotate, rotmat_from_6d, turn
from omomo_core.learning.training.corpus import Corpus, Windows
from omomo_core.learning.training.training_task import Mean, TrainOptions
from omomo_core.stages import body_capture, body_paper
from omomo_core.stages import hands_capture as hand_capture
from omomo_core.stages import hands_paper as hand_paper
from omomo_core.stages.stage import Stage, StageConfig
from omomo_core.stages.stage_config import shape_code

PALM_OFFSET, PALM_JITTER = 0.025, 0.01
"""Noise on the palms that stage 2 is trained with, metres: per window, and per frame (smooth)."""
START_KNOWN, START_NOISE = 0.4, 0.08
"""Share of windows in which stage 1 is told where the person stands at first, and how wrong, metres."""


@dataclass(frozen=True)
class Example:
    """A batch for one stage."""

    x0: Float[Tensor, "b frames channels"]
    condition: Float[Tensor, "b frames condition"]
    shape: Float[Tensor, "b tokens shape"] | None
    """One code for each token of the network, or one for the window."""
    valid: Bool[Tensor, "b frames"]


def make_example(config: StageConfig, windows: Windows) -> Example:
    """Features of a batch of windows for the given stage and configuration."""
    if config.configuration == "capture":
        return _hands_capture(windows) if config.stage == "hands" else _body_capture(windows)
    return _paper(config, windows)


def _hands_capture(windows: Windows) -> Example:
    moved, person = windows.object, windows.human
    yaw = hand_capture.training_yaw(moved)
    axes = hand_capture.object_axes(moved, yaw)
    x = hand_capture.pack(person.joints[:, :, 22:], person.hand_contact, moved)
    return Example(
        x0=rotate(x, axes.transpose(-1, -2), hand_capture.LAYOUT),
        condition=hand_capture.condition(moved, yaw, axes, _start(windows)),
        shape=hand_capture.shape_code(moved, axes),
        valid=moved.valid,
    )


def _start(windows: Windows) -> Float[Tensor, "b 3"]:
    """Return where the person is in the first frame, about, in some of the windows."""
    away = windows.human.joints[:, 0, 0, :2] - windows.object.centre[:, 0, :2]
    away = away + START_NOISE * torch.randn_like(away)
    known = torch.rand(len(away), 1) < START_KNOWN
    return torch.cat([away, torch.ones(len(away), 1)], dim=-1) * known


def _body_capture(windows: Windows) -> Example:
    moved, person = windows.object, windows.human
    palms = _disturb(person.joints[:, :, 22:])
    yaw = body_capture.training_yaw(palms, moved)
    return Example(
        x0=turn(body_capture.pack(person), -yaw, body_capture.LAYOUT),
        condition=body_capture.condition(
            palms, person.hand_contact, person.reference, person.upright, moved, yaw
        ),
        shape=shape_code(moved, yaw),
        valid=moved.valid,
    )


def _paper(config: StageConfig, windows: Windows) -> Example:
    """Palms from the object, the body from the palms, or the body from the object."""
    moved, person = windows.object, windows.human
    R = rotmat_from_6d(person.rotations_6d)
    origin, yaw = human_frame(person.joints[:, 0, 0], R[:, 0, 0])
    if config.stage == "hands":
        x = hand_paper.pack(person.joints[:, :, 22:], origin, yaw)
    else:
        x = body_paper.pack(person.joints, R, origin, yaw)
    if config.stage == "body":
        # Raw: the training normalises the palms' slots with x0's own statistics and adds the noise.
        return Example(x0=x, condition=torch.zeros_like(x), shape=None, valid=moved.valid)
    return Example(
        x0=x,
        condition=hand_paper.condition(moved, origin, yaw),
        shape=hand_paper.shape_code(moved, yaw, config.denoiser.patch),
        valid=moved.valid,
    )


def _disturb(palms: Float[Tensor, "b frames 2 3"]) -> Float[Tensor, "b frames 2 3"]:
    """Return disturbed palms: stage 2 gets palms that stage 1 predicted, so it is trained on inexact ones."""
    offset = PALM_OFFSET * torch.randn(len(palms), 1, 2, 3)
    knots = PALM_JITTER * torch.randn(len(palms), 6, palms.shape[1] // 8 + 1)
    smooth = torch.nn.functional.interpolate(
        knots, size=palms.shape[1], mode="linear", align_corners=True
    )
    return palms + offset + smooth.transpose(1, 2).unflatten(-1, (2, 3))


STATISTICS_BATCHES = 8


@dataclass(frozen=True)
class Noised(Example):
    """A batch, raw, with the levels and the noise it is trained at."""

    level: Int[Tensor, " b"]
    noise: Float[Tensor, "b frames channels"]


class Denoising:
    """A stage of either configuration in training."""

    def __init__(self, config: StageConfig) -> None:
        self.name = str(config.stage)
        self.network = Stage(config)
        self.config = config
        self.muon = _matrices(self.network) if config.configuration == "capture" else []

    def measure(self, corpus: Corpus, batch: int) -> None:
        """Set the statistics that put features on one scale."""
        examples = [self._windows(corpus, batch) for _ in range(STATISTICS_BATCHES)]
        stage, x = self.network, torch.cat([e.x0[e.valid] for e in examples])
        if self.config.configuration == "paper":
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

    def draw(self, corpus: Corpus, count: int) -> Noised:
        """Random windows, levels and noise."""
        e = self._windows(corpus, count)
        condition = e.condition
        if self.config.configuration == "paper" and self.config.stage == "body":
            # Noise in every slot but the palms', which `loss` puts in, normalised.
            condition = torch.randn(e.x0.shape)
        share = shifted(torch.rand(count), self.config.level_shift)
        return Noised(
            x0=e.x0,
            condition=condition,
            shape=e.shape,
            valid=e.valid,
            level=(share * (LEVELS - 1)).round().long(),
            noise=torch.randn(e.x0.shape),
        )

    def loss(
        self, forward: nn.Module, example: Noised, options: TrainOptions, mean: Mean
    ) -> Float[Tensor, ""]:
        """L1 on x0 as published, or the losses of the capture configuration."""
        stage, e = self.network, example
        x0, condition = stage.normalise(e.x0), e.condition
        if self.config.configuration == "paper" and self.config.stage == "body":
            condition = condition.clone()
            condition[..., body_paper.PALMS] = x0[..., body_paper.PALMS]
        x_n = _schedule(x0.device).add_noise(x0, e.level, e.noise)
        half = torch.autocast(x0.device.type, torch.bfloat16, enabled=quick_in_bf16(x0.device))
        with half, _attention(x0.device):
            guess = forward(x_n, condition, e.shape, e.level, e.valid)
        error = guess.float() - x0
        if self.config.configuration == "paper":
            # The paper divides by all frames, padding included, and has no other term.
            return (error.abs() * e.valid[..., None]).mean()
        return self._ours(error, e.valid, options, mean)

    def _ours(
        self,
        error: Float[Tensor, "b frames channels"],
        valid: Bool[Tensor, "b frames"],
        options: TrainOptions,
        mean: Mean,
    ) -> Float[Tensor, ""]:
        """L1 on x0, on its change from frame to frame, on the feet's, and once more on the root."""
        both = (valid[:, 1:] & valid[:, :-1])[..., None]

        def change(x: Tensor) -> Tensor:
            return (x.diff(dim=1).abs() * both).sum() / (mean(both.sum()) * x.shape[-1])

        whole = (error.abs() * valid[..., None]).sum() / (mean(valid.sum()) * error.shape[-1])
        whole = whole + options.velocity * change(error)
        if self.config.stage == "body":
            feet = body_capture.feet(error * self.network.x_std)
            root = (error[..., :3].abs() * valid[..., None]).sum() / (3 * mean(valid.sum()))
            whole = whole + options.feet * change(feet) + options.root * root
        return whole

    def _windows(self, corpus: Corpus, count: int) -> Example:
        points = self.config.denoiser.shape // 3
        # Only our body stage has something to learn from people who hold nothing.
        objects_only = not (self.config.configuration == "capture" and self.config.stage == "body")
        return make_example(self.config, corpus.draw(count, points, objects_only=objects_only))


def _matrices(stage: Stage) -> Sequence[nn.Parameter]:
    """The matrices inside the blocks."""
    return [p for p in stage.denoiser.blocks.parameters() if p.ndim == 2 and min(p.shape) > 6]


def _attention(device: torch.device) -> AbstractContextManager[object]:
    """On a CPU the way back through fused attention takes a sixth of a step; plain products do not."""
    return sdpa_kernel(SDPBackend.MATH) if device.type == "cpu" else nullcontext()


@lru_cache
def _schedule(device: torch.device) -> Schedule:
    schedule = cosine_schedule()
    return Schedule(schedule.beta.to(device), schedule.alpha_bar.to(device))
