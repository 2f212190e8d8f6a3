"""GOAL's motion network: four residual blocks that say how the next ten frames differ from this one."""

from dataclasses import dataclass
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor, nn

from omomo_core.learning.baselines.goal.features import BODY_POINTS, HAND_POINTS
from omomo_core.stages.paper import Size

PAST, FUTURE = 5, 10
"""Frames seen, the current one included, and frames predicted."""
POSE = 3 + 22 * 6
"""Numbers that are predicted of a frame: root, and two rows of each global rotation."""
SEEN = 72 + 22 * 6
"""Numbers that are seen of a frame: 24 joints, and the rotations."""
PALM_WAYS = 6
"""From both palms to the object's surface."""


@dataclass(frozen=True)
class GoalConfig:
    """Sizes of the network; the defaults are GOAL's own."""

    feelers: int = BODY_POINTS + 2 * HAND_POINTS
    """Points of the body that tell where the object's surface is."""
    widths: tuple[int, ...] = (2048, 1024, 1024, 2048)
    hidden: int = 256
    dropout: float = 0.3


def config(size: Size) -> GoalConfig:
    """The published trunk, or one of half the width."""
    return GoalConfig() if size == "published" else GoalConfig(widths=(1024, 512, 512, 1024))


class ResidualBlock(nn.Module):
    """Two linear layers with batch norm beside a skip, which is linear where the widths differ."""

    def __init__(self, inward: int, outward: int, hidden: int) -> None:
        super().__init__()
        self.inner = nn.Sequential(
            nn.Linear(inward, hidden),
            nn.BatchNorm1d(hidden),
            nn.LeakyReLU(0.2),
            nn.Linear(hidden, outward),
            nn.BatchNorm1d(outward),
        )
        same = nn.Identity()
        changed = nn.Sequential(nn.Linear(inward, outward), nn.LeakyReLU(0.2))
        self.skip = same if inward == outward else changed
        self.end = nn.LeakyReLU(0.2)

    def forward(self, x: Float[Tensor, "b inward"]) -> Float[Tensor, "b outward"]:
        """One block."""
        return self.end(self.inner(x) + self.skip(x))


class Goal(nn.Module):
    """Features of one moment in, offsets of the next ten frames out; all in the current frame's axes.

    `feelers` are the vertices of the body that the features were measured from in training.
    """

    def __init__(self, config: GoalConfig) -> None:
        super().__init__()
        self.config = config
        seen = PAST * SEEN + 3 * config.feelers
        self.feelers: Tensor
        self.register_buffer("feelers", torch.zeros(config.feelers, dtype=torch.int64))
        self.scale = nn.BatchNorm1d(seen)
        inward = (seen, config.widths[0] + seen, *config.widths[1:-1])
        self.blocks = nn.ModuleList(
            ResidualBlock(a, b, config.hidden) for a, b in zip(inward, config.widths, strict=True)
        )
        self.dropout = nn.Dropout(config.dropout)
        self.out = nn.Linear(config.widths[-1], FUTURE * (POSE + PALM_WAYS))

    def forward(self, features: Float[Tensor, "b features"]) -> Float[Tensor, "b 10 141"]:
        """Offsets of the pose (`POSE` numbers), then of the ways from the palms to the object."""
        first, second, *rest = self.blocks
        x = self.scale(features)
        h = self.dropout(first(x))
        h = self.dropout(second(torch.cat([h, x], dim=-1)))
        for block in rest:
            h = block(h)
        return self.out(h).unflatten(-1, (FUTURE, -1))


def build(config: dict[str, Any]) -> Goal:
    """From the configuration as JSON holds it."""
    widths = tuple(config.pop("widths"))
    return Goal(GoalConfig(**config, widths=widths))
