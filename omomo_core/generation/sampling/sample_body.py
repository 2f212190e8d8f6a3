"""Stage 2 sampled over windows that overlap.

Every denoising step of every window sees the others' estimates (the idea of MultiDiffusion,
Bar-Tal et al. 2023), so the windows end as one motion without a seam.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from omomo_core.compute import batch_parts
from omomo_core.diffusion.samplers import cosine_schedule, golden_sequence, sample
from omomo_core.generation.generation_options import (
    FeaturePrefix,
    GenerationOptions,
    Prefix,
    Progress,
)
from omomo_core.generation.object_clip import ObjectClip
from omomo_core.geometry.rotations import Layout, rotate, yaw_matrix
from omomo_core.motion import HandMotion
from omomo_core.stages import body_capture as body_stage
from omomo_core.stages.stage import WINDOW, Stage, object_windows, window_frames
from omomo_core.stages.stage_config import BASIS_POINTS, shape_code

CHUNK = 64
"""Windows that go through the network at once: bounds memory on long takes."""


def merge_windows(
    x: Float[Tensor, "samples windows window channels"],
    index: Int[Tensor, "windows window"],
    frames: int,
) -> Float[Tensor, "samples frames channels"]:
    """Return one value per frame of the take: the mean of its windows, weighted to the windows' middles."""
    ramp = torch.minimum(torch.arange(WINDOW) + 1, WINDOW - torch.arange(WINDOW)).to(x.dtype)
    # Padding repeats the last frame: only its first appearance counts.
    repeated = torch.zeros_like(index, dtype=torch.bool)
    repeated[:, 1:] = index[:, 1:] == index[:, :-1]
    weight = ramp * ~repeated
    total = torch.zeros(frames, dtype=x.dtype).index_add(0, index.flatten(), weight.flatten())
    summed = torch.zeros(len(x), frames, x.shape[-1], dtype=x.dtype)
    summed.index_add_(1, index.flatten(), (x * weight[..., None]).flatten(1, 2))
    return summed / total[:, None]


@dataclass(frozen=True)
class WindowConditions:
    """What conditions the network in each window; the batch is samples x windows, sample-major."""

    valid: Bool[Tensor, "b window"]
    condition: Float[Tensor, "b window condition"]
    shape: Float[Tensor, "b tokens shape"]
    axes: Float[Tensor, "b _ 3 3"]
    """R_world_axes of the network's features, for each window or each of its frames."""


def sample_take(
    stage: Stage,
    noise: Float[Tensor, "samples frames channels"],
    conditions: WindowConditions,
    layout: Layout,
    options: GenerationOptions,
    generator: torch.Generator,
    *,
    impose: Callable[[Tensor], Tensor] = lambda estimate: estimate,
    on_step: Callable[[float], None],
    threads: int = 1,
) -> Float[Tensor, "samples frames channels"]:
    """Return the features of K samples of a take that are denoised from `noise`; raw units, world axes.

    What `impose` fixes in every estimate (inpainting) the other frames and features follow. So many threads
    go through the network with a part of the windows each.
    """
    samples, frames = noise.shape[:2]
    index, axes = window_frames(frames), conditions.axes

    def to_world(x: Tensor) -> Tensor:
        raw = rotate(stage.denormalise(x), axes, layout)
        return impose(merge_windows(raw.unflatten(0, (samples, len(index))), index, frames))

    # A graphics card takes all at once.
    count = threads if stage.denoiser.out.weight.device.type == "cpu" else 1
    parts = batch_parts(len(noise) * len(index), CHUNK, count)

    def predict(x: Tensor, n: int) -> Tensor:
        def of(some: slice) -> Tensor:
            told = (conditions.condition[some], conditions.shape[some])
            level = torch.full((len(x[some]),), n)
            with torch.inference_mode():
                return stage(x[some], *told, level, conditions.valid[some])

        shared = to_world(torch.cat(list(pool.map(of, parts))))[:, index].flatten(0, 1)
        return stage.normalise(rotate(shared, axes.transpose(-1, -2), layout))

    with torch.inference_mode(), _network_threads(count) as pool:
        x = sample(
            predict,
            noise[:, index].flatten(0, 1),
            cosine_schedule(),
            generator,
            sampler=options.sampler,
            steps=options.steps,
            shift=stage.config.level_shift,
            on_step=on_step,
        )
        return to_world(x)


def _network_threads(count: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(count, initializer=torch.set_num_threads, initargs=(1,))


def sample_body(
    clip: ObjectClip,
    hands: Sequence[HandMotion],
    stage: Stage,
    options: GenerationOptions,
    generator: torch.Generator,
    progress: Progress,
    prefix: Prefix | None,
    *,
    threads: int = 1,
) -> Float[Tensor, "samples frames channels"]:
    """Return the features of a body for the palms of each sample; the root in the networks' world, metres.

    Args:
        clip: the object.
        hands: palms and contact of each sample, world, metres.
        stage: the network.
        options: sampler and its steps.
        generator: source of randomness.
        progress: called with "body" and the fraction done.
        prefix: the first frames, where they are fixed.
        threads: that go through the network.
    """
    index = window_frames(clip.trained.frames)
    windows = object_windows(clip.trained, index, len(hands), BASIS_POINTS)
    contact = torch.from_numpy(np.stack([h.contact for h in hands])).float()
    above = clip.above_soles(np.stack([h.palms for h in hands]))
    palms = torch.from_numpy(above).float() * clip.scale
    reference = body_stage.reference_path(palms)
    cut_palms = palms[:, index].flatten(0, 1)
    yaw = body_stage.canonical_yaw(cut_palms, windows)
    condition = body_stage.condition(
        cut_palms,
        (contact[:, index].flatten(0, 1) > 0.5).float(),
        reference[:, index].flatten(0, 1),
        posture_levels(len(hands), options.seed).repeat_interleave(len(index)),
        windows,
        yaw,
    )
    x = sample_take(
        stage,
        torch.randn(*contact.shape[:2], body_stage.LAYOUT.channels, generator=generator),
        WindowConditions(
            windows.valid, condition, shape_code(windows, yaw), yaw_matrix(yaw)[:, None]
        ),
        body_stage.LAYOUT,
        options,
        generator,
        impose=_relative_to(prefix.body, reference).impose if prefix else lambda x: x,
        on_step=lambda done: progress("body", done),
        threads=threads,
    )
    return torch.cat([x[..., :2] + reference, x[..., 2:]], dim=-1)


def posture_levels(samples: int, seed: int) -> Float[Tensor, " samples"]:
    """Return how upright each sample stays, from deep squats (0) to straight legs (1).

    Levels are spread evenly over all samples and over any few neighbours, which hold the object from the same
    side. They are the same in all chunks of a take, so that a person who squats once squats again. A single
    sample has the middle level.
    """
    first = torch.randint(1000, (1,), generator=torch.Generator().manual_seed(seed))
    rank = golden_sequence(first + torch.arange(samples)).argsort().argsort()
    return (rank + 0.5) / samples


def _relative_to(
    prefix: FeaturePrefix, reference: Float[Tensor, "samples frames 2"]
) -> FeaturePrefix:
    values = prefix.values.clone()
    values[..., :2] -= reference[:, : values.shape[1]]
    return replace(prefix, values=values)
