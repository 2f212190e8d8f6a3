"""Steps and standing poses of the mocap, from which base motions are generated."""

from dataclasses import dataclass, replace

import torch

from omomo_core.body.model import BodyModel
from omomo_core.learning.synthesis.footage import Footage
from omomo_core.learning.synthesis.walker.bearing import StandingPoses, find_standing


@dataclass(frozen=True)
class MotionLibrary:
    """Small enough to be sent to every worker process once."""

    body: BodyModel
    """Bones and floor only: its surface is one triangle of no use."""
    standing: StandingPoses
    licence: str
    """Of all mocap in it."""


def index(footage: Footage, body: BodyModel) -> MotionLibrary:
    """Look up how people stand and walk in the mocap.

    Raises:
        InputError: ``walker-standing`` when nobody in the footage stands at ease.
    """
    standing = find_standing(footage, body)
    licences = sorted({stretch.licence for stretch in footage.stretches})
    return MotionLibrary(_bones(body), standing, "; ".join(licences))


def _bones(body: BodyModel) -> BodyModel:
    """The body without its surface, of which only the lowest point matters here."""
    lowest = int(body.vertices[:, 1].argmin())
    kept = slice(lowest, lowest + 1)
    return replace(
        body,
        vertices=body.vertices[kept].clone(),
        faces=torch.zeros(0, 3, dtype=torch.int64),
        skin_joints=body.skin_joints[kept].clone(),
        skin_weights=body.skin_weights[kept].clone(),
    )
