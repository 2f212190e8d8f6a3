"""Recorded clips cut into the windows that the paper evaluates (its published evaluation)."""

from dataclasses import replace

import numpy as np

from omomo_core.errors import InputError
from omomo_core.learning.evaluation.clips import RealClip
from omomo_core.stages.windows import WINDOW

STRIDE = WINDOW // 2
SHORTEST = 30
"""Frames: a rest that is shorter is left out."""


def windows_of(clip: RealClip) -> list[RealClip]:
    """Windows of 120 frames that overlap by half; those at the end are shorter, 30 frames at least.

    Each is called ``<clip>@<its first frame>``.

    Raises:
        InputError: ``clip-too-short`` when there is not one window in the clip.
    """
    frames = len(clip.root)
    if frames < SHORTEST:
        raise InputError(
            "clip-too-short",
            f"It has {frames} frames; a window has {SHORTEST} at least.",
            where=clip.name,
            fix="Leave the clip out.",
        )
    return [_cut(clip, start) for start in range(0, frames - SHORTEST + 1, STRIDE)]


def clip_of(window: str) -> str:
    """The clip that a window was cut from, by their names."""
    return window.rsplit("@", 1)[0]


def _cut(clip: RealClip, start: int) -> RealClip:
    here = slice(start, start + WINDOW)
    motion = replace(
        clip.motion,
        T_world_object=clip.motion.T_world_object[here].astype(np.float64),
        valid=clip.motion.valid[here],
    )
    return replace(
        clip,
        name=f"{clip.name}@{start}",
        motion=motion,
        root=clip.root[here],
        rotations=clip.rotations[here],
        joints=clip.joints[here],
    )
