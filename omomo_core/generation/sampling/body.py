"""Sampling of stage 2: a whole body for the palms of each sample."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from omomo_core.diffusion.low_discrepancy import golden_sequence
from omomo_core.generation.object_clip import ObjectClip
from omomo_core.generation.prefix import FeaturePrefix, Prefix
from omomo_core.generation.result import GenerationOptions, Progress
from omomo_core.generation.sampling.windows import WindowConditions, sample_take
from omomo_core.geometry.rotations import yaw_matrix
from omomo_core.motion import HandMotion
from omomo_core.stages.body import capture as body_stage
from omomo_core.stages.capture import BASIS_POINTS, shape_code
from omomo_core.stages.stage import Stage
from omomo_core.stages.windows import object_windows, window_frames


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
