"""From windows to what each stage is trained on: x0, condition, shape code, all raw (not normalised)."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from omomo_core.geometry.canonical import rotate, turn
from omomo_core.geometry.human_frame import human_frame
from omomo_core.geometry.rotations import rotmat_from_6d
from omomo_core.learning.training.corpus import Windows
from omomo_core.stages.body import capture as body_capture
from omomo_core.stages.body import paper as body_paper
from omomo_core.stages.capture import shape_code
from omomo_core.stages.hands import capture as hand_capture
from omomo_core.stages.hands import paper as hand_paper
from omomo_core.stages.stage import StageConfig

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
