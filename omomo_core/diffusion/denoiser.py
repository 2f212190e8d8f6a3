"""The denoising transformer of both stages (OMOMO section 3.2, figure 3)."""

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn

from omomo_core.diffusion.blocks import Block, DenoiserConfig, ModulatedBlock


class Denoiser(nn.Module):
    """(x_n, condition, n) -> x0: transformer over tokens of one or a few frames."""

    def __init__(self, config: DenoiserConfig) -> None:
        super().__init__()
        self.config = c = config
        shape_out = c.shape_width if c.shape else 0
        if c.shape:
            self.shape_code = nn.Sequential(
                nn.Linear(c.shape, c.shape_hidden),
                nn.ReLU(),
                nn.Linear(c.shape_hidden, c.shape_width),
            )
        self.embed = nn.Linear(c.patch * (c.channels + c.condition) + shape_out, c.width)
        level_out = 6 * c.width if c.modulated else c.width
        self.noise_level = nn.Sequential(nn.Linear(64, 256), nn.GELU(), nn.Linear(256, level_out))
        block = ModulatedBlock if c.modulated else Block
        self.blocks = nn.ModuleList(block(c) for _ in range(c.layers))
        self.norm = nn.LayerNorm(c.width) if c.modulated else nn.Identity()
        self.out = nn.Linear(c.width, c.patch * c.channels)
        if c.modulated:
            # Blocks start as they are without modulation.
            for parameter in self.noise_level[2].parameters():
                nn.init.zeros_(parameter)
        table = sinusoid(torch.arange(c.max_tokens + 1), c.width)
        self.positions: Tensor
        self.register_buffer("positions", table, persistent=False)

    def forward(
        self,
        x: Float[Tensor, "b frames channels"],
        condition: Float[Tensor, "b frames condition"],
        shape: Float[Tensor, " b #tokens shape"] | None,
        level: Int[Tensor, " b"],
        valid: Bool[Tensor, "b frames"],
    ) -> Float[Tensor, "b frames channels"]:
        """Predict x0. Frames must divide by the patch; `valid` is False on padding."""
        c, (b, frames, _) = self.config, x.shape
        tokens = frames // c.patch
        parts = [torch.cat([x, condition], dim=-1).reshape(b, tokens, -1)]
        if shape is not None:
            parts.append(self.shape_code(shape).expand(b, tokens, -1))
        h = self.embed(torch.cat(parts, dim=-1))
        seen = valid.reshape(b, tokens, c.patch).any(dim=-1)
        noise = self.noise_level(sinusoid(level, 64).to(h.dtype))
        h = self._modulated(h, seen, noise) if c.modulated else self._published(h, seen, noise)
        return self.out(self.norm(h)).reshape(b, frames, c.channels)

    def _modulated(self, h: Tensor, seen: Tensor, noise: Tensor) -> Tensor:
        h = h + 0.5 * self.positions[1 : h.shape[1] + 1]
        modulation = noise.unflatten(-1, (6, -1))
        for block in self.blocks:
            h = block(h, seen, modulation)
        return h

    def _published(self, h: Tensor, seen: Tensor, noise: Tensor) -> Tensor:
        """The noise level is a first token."""
        h = torch.cat([noise[:, None], h], dim=1) + self.positions[1 : h.shape[1] + 2]
        seen = torch.cat([torch.ones_like(seen[:, :1]), seen], dim=1)
        for block in self.blocks:
            h = block(h, seen)
        return h[:, 1:]


def sinusoid(position: Int[Tensor, " n"], width: int) -> Float[Tensor, "n width"]:
    """Sinusoidal code of integers (Vaswani et al. 2017): sines, then cosines."""
    half = width // 2
    rate = torch.exp(-torch.arange(half, device=position.device) * (9.210340372 / (half - 1)))
    angle = position[:, None].float() * rate
    return torch.cat([angle.sin(), angle.cos()], dim=-1)
