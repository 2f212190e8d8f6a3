"""Clips of training data to look at: rows of pictures over time, and short videos."""

from collections.abc import Iterator, Sequence

import cv2
import numpy as np
import torch
from jaxtyping import UInt8

from omomo_core.body.kinematics import joints_of
from omomo_core.body.model import BodyModel
from omomo_core.learning.recordings.clips import Clip
from omomo_core.motion import HumanMotion, ObjectMotion
from render.backends import Backend
from render.third_person import frames
from render.video import contact_sheet

Picture = UInt8[np.ndarray, "h w 3"]

_BAND, _INK = 24, (60, 60, 64)


def clip_row(
    clip: Clip,
    body: BodyModel,
    label: str,
    *,
    moments: int = 8,
    width: int = 240,
    height: int = 270,
    backend: Backend = "auto",
) -> Picture:
    """A clip as pictures from its first to its last frame under a line of text; touching palms green.

    Args:
        clip: with an object.
        body: whose skin to draw.
        label: the line of text.
        moments: how many pictures.
        width, height: of one picture, pixels.
        backend: see `open_renderer`.
    """
    human, moved = _motions(clip, body)
    only = np.linspace(0, len(human.root) - 1, moments).round().astype(int).tolist()
    pictures = frames(human, moved, body, width=width, height=height, backend=backend, only=only)
    row = contact_sheet(list(pictures), moments)
    band = np.full((_BAND, row.shape[1], 3), 255, np.uint8)
    cv2.putText(band, label, (6, 17), cv2.FONT_HERSHEY_SIMPLEX, 0.48, _INK, 1, cv2.LINE_AA)
    return np.concatenate([band, row])


def clip_video(
    clip: Clip,
    body: BodyModel,
    label: str,
    *,
    width: int = 640,
    height: int = 480,
    backend: Backend = "auto",
    stride: int = 1,
) -> Iterator[Picture]:
    """Pictures of a clip, every `stride`-th frame, with a label in the corner."""
    human, moved = _motions(clip, body)
    only: Sequence[int] = range(0, len(human.root), stride)
    return frames(
        human, moved, body, width=width, height=height, backend=backend, label=label, only=only
    )


def _motions(clip: Clip, body: BodyModel) -> tuple[HumanMotion, ObjectMotion]:
    assert clip.object_motion is not None
    root, rotations = (x.astype(np.float64) for x in (clip.root, clip.rotations))
    fingers = torch.tile(body.relaxed_fingers.double(), (len(root), 1, 1, 1)).numpy()
    human = HumanMotion(
        root=root,
        rotations=rotations,
        fingers=fingers,
        joints=joints_of(body, root, rotations),
        hand_contact=clip.hand_contact,
        foot_contact=clip.foot_contact,
    )
    return human, clip.object_motion
