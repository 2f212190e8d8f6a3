"""Long takes: windows denoised together, their estimates averaged where they overlap.

Every denoising step of every window sees the others' estimates (the idea of MultiDiffusion,
Bar-Tal et al. 2023), so the windows end as one motion without a seam.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from omomo_core.diffusion.samplers import sample
from omomo_core.diffusion.schedule import cosine_schedule
from omomo_core.generation.result import GenerationOptions
from omomo_core.geometry.canonical import Layout, rotate
from omomo_core.stages.stage import Stage
from omomo_core.stages.windows import WINDOW, window_frames

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
) -> Float[Tensor, "samples frames channels"]:
    """Return the features of K samples of a take that are denoised from `noise`; raw units, world axes.

    What `impose` fixes in every estimate (inpainting) the other frames and features follow.
    """
    samples, frames = noise.shape[:2]
    index, axes = window_frames(frames), conditions.axes

    def to_world(x: Tensor) -> Tensor:
        raw = rotate(stage.denormalise(x), axes, layout)
        return impose(merge_windows(raw.unflatten(0, (samples, len(index))), index, frames))

    def predict(x: Tensor, n: int) -> Tensor:
        parts = [
            stage(
                x[i],
                conditions.condition[i],
                conditions.shape[i],
                torch.full((len(x[i]),), n),
                conditions.valid[i],
            )
            for i in (slice(a, a + CHUNK) for a in range(0, len(x), CHUNK))
        ]
        shared = to_world(torch.cat(parts))[:, index].flatten(0, 1)
        return stage.normalise(rotate(shared, axes.transpose(-1, -2), layout))

    with torch.inference_mode():
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
