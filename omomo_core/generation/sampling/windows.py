"""Long takes: windows denoised together, their estimates averaged where they overlap.

Every denoising step of every window sees the others' estimates (the idea of MultiDiffusion,
Bar-Tal et al. 2023), so the windows end as one motion without a seam.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from omomo_core.diffusion.samplers import sample
from omomo_core.diffusion.schedule import cosine_schedule
from omomo_core.generation.result import GenerationOptions
from omomo_core.generation.threads import batch_parts
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
