"""The denoising transformer of both stages (OMOMO section 3.2, figure 3), and its blocks."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn


@dataclass(frozen=True)
class DenoiserConfig:
    """Sizes of a denoiser; the defaults are the paper's."""

    channels: int
    """Channels of x."""
    condition: int
    """Channels of the condition given per frame."""
    shape: int = 0
    """Channels of the object's shape code given per token; 0 when the stage does not see it."""
    shape_hidden: int = 512
    shape_width: int = 256
    width: int = 512
    layers: int = 4
    heads: int = 4
    head_width: int = 256
    feedforward: int = 512
    patch: int = 1
    """Consecutive frames joined into one token."""
    mask_keys: bool = False
    """Hide padded frames from attention; the paper lets them leak into the valid ones."""
    dropout: float = 0.1
    modulated: bool = False
    """The noise level scales and shifts every block (`ModulatedBlock`) instead of being a token."""
    max_tokens: int = 256


class Block(nn.Module):
    """Self-attention and feed-forward, each followed by residual and layer norm."""

    def __init__(self, config: DenoiserConfig) -> None:
        super().__init__()
        self.config = c = config
        inner = c.heads * c.head_width
        self.qkv = nn.Linear(c.width, 3 * inner)
        self.attention_out = nn.Linear(inner, c.width)
        self.attention_norm = nn.LayerNorm(c.width)
        self.feedforward = nn.Sequential(
            nn.Linear(c.width, c.feedforward), nn.ReLU(), nn.Linear(c.feedforward, c.width)
        )
        self.feedforward_norm = nn.LayerNorm(c.width)
        self.dropout = nn.Dropout(c.dropout)

    def forward(
        self, h: Float[Tensor, "b tokens width"], seen: Bool[Tensor, "b tokens"]
    ) -> Float[Tensor, "b tokens width"]:
        """One block; padded tokens are zeroed after each half, as in the paper."""
        c = self.config
        keep = seen[..., None].to(h.dtype)
        dropout = c.dropout if self.training else 0.0
        mixed = self.attention_out(
            attend(self.qkv(h), c.heads, seen if c.mask_keys else None, dropout)
        )
        h = self.attention_norm(h + self.dropout(mixed)) * keep
        return self.feedforward_norm(h + self.dropout(self.feedforward(h))) * keep


class ModulatedBlock(nn.Module):
    """Pre-norm block whose norms and residuals the noise level scales and shifts.

    The idea is that of Peebles and Xie 2023 (adaLN); the modulation is shared by all blocks but for a
    table of each block's own, as in Chen et al. 2023 (PixArt).
    """

    def __init__(self, config: DenoiserConfig) -> None:
        super().__init__()
        self.config = c = config
        inner = c.heads * c.head_width
        self.attention_norm = nn.LayerNorm(c.width, elementwise_affine=False)
        self.qkv = nn.Linear(c.width, 3 * inner)
        self.attention_out = nn.Linear(inner, c.width)
        self.feedforward_norm = nn.LayerNorm(c.width, elementwise_affine=False)
        self.feedforward = nn.Sequential(
            nn.Linear(c.width, c.feedforward), nn.GELU(), nn.Linear(c.feedforward, c.width)
        )
        self.table = nn.Parameter(torch.zeros(6, c.width))
        self.dropout = nn.Dropout(c.dropout)

    def forward(
        self,
        h: Float[Tensor, "b tokens width"],
        seen: Bool[Tensor, "b tokens"],
        modulation: Float[Tensor, "b 6 width"],
    ) -> Float[Tensor, "b tokens width"]:
        """One block; `modulation` is scale, shift and gate of the attention, then of the rest."""
        c = self.config
        scale, shift, gate, scale2, shift2, gate2 = (modulation + self.table)[:, :, None].unbind(1)
        dropout = c.dropout if self.training else 0.0
        x = self.attention_norm(h) * (1 + scale) + shift
        mixed = self.attention_out(attend(self.qkv(x), c.heads, seen, dropout))
        h = h + (1 + gate) * self.dropout(mixed)
        x = self.feedforward_norm(h) * (1 + scale2) + shift2
        return h + (1 + gate2) * self.dropout(self.feedforward(x))


def attend(
    qkv: Float[Tensor, "b tokens inner3"],
    heads: int,
    seen: Bool[Tensor, "b tokens"] | None,
    dropout: float,
) -> Float[Tensor, "b tokens inner"]:
    """Multi-head attention from stacked queries, keys and values; unseen keys are left out."""
    b, tokens, _ = qkv.shape
    q, k, v = qkv.reshape(b, tokens, 3, heads, -1).permute(2, 0, 3, 1, 4)
    mask = None if seen is None else seen[:, None, None]
    mixed = nn.functional.scaled_dot_product_attention(q, k, v, attn_mask=mask, dropout_p=dropout)
    return mixed.transpose(1, 2).reshape(b, tokens, -1)


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
