"""The denoising transformer of both stages (OMOMO section 3.2, figure 3)."""

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
    max_tokens: int = 256


class Denoiser(nn.Module):
    """(x_n, condition, n) -> x0: post-norm transformer with the noise level as a first token."""

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
        self.noise_level = nn.Sequential(nn.Linear(64, 256), nn.GELU(), nn.Linear(256, c.width))
        self.blocks = nn.ModuleList(Block(c) for _ in range(c.layers))
        self.out = nn.Linear(c.width, c.patch * c.channels)
        table = sinusoid(torch.arange(c.max_tokens + 1), c.width)
        self.positions: Tensor
        self.register_buffer("positions", table, persistent=False)

    def forward(
        self,
        x: Float[Tensor, "b frames channels"],
        condition: Float[Tensor, "b frames condition"],
        shape: Float[Tensor, "b tokens shape"] | None,
        level: Int[Tensor, " b"],
        valid: Bool[Tensor, "b frames"],
    ) -> Float[Tensor, "b frames channels"]:
        """Predict x0. Frames must divide by the patch; `valid` is False on padding."""
        c, (b, frames, _) = self.config, x.shape
        tokens = frames // c.patch
        parts = [torch.cat([x, condition], dim=-1).reshape(b, tokens, -1)]
        if shape is not None:
            parts.append(self.shape_code(shape))
        h = self.embed(torch.cat(parts, dim=-1))
        first = self.noise_level(sinusoid(level, 64).to(h.dtype))[:, None]
        h = torch.cat([first, h], dim=1) + self.positions[1 : tokens + 2]
        seen = torch.ones(b, tokens + 1, dtype=torch.bool, device=x.device)
        seen[:, 1:] = valid.reshape(b, tokens, c.patch).any(dim=-1)
        for block in self.blocks:
            h = block(h, seen)
        return self.out(h[:, 1:]).reshape(b, frames, c.channels)


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
        c, (b, tokens, _) = self.config, h.shape
        keep = seen[..., None].to(h.dtype)
        q, k, v = self.qkv(h).reshape(b, tokens, 3, c.heads, -1).permute(2, 0, 3, 1, 4)
        mask = seen[:, None, None] if c.mask_keys else None
        mixed = nn.functional.scaled_dot_product_attention(
            q, k, v, attn_mask=mask, dropout_p=c.dropout if self.training else 0.0
        )
        mixed = self.attention_out(mixed.transpose(1, 2).reshape(b, tokens, -1))
        h = self.attention_norm(h + self.dropout(mixed)) * keep
        return self.feedforward_norm(h + self.dropout(self.feedforward(h))) * keep


def sinusoid(position: Int[Tensor, " n"], width: int) -> Float[Tensor, "n width"]:
    """Sinusoidal code of integers (Vaswani et al. 2017): sines, then cosines."""
    half = width // 2
    rate = torch.exp(-torch.arange(half, device=position.device) * (9.210340372 / (half - 1)))
    angle = position[:, None].float() * rate
    return torch.cat([angle.sin(), angle.cos()], dim=-1)
