"""Texture look-ups in numpy: bilinear, from smaller copies of the texture where it is far away."""

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8


class MipMaps:
    """A repeating texture and its halved copies."""

    def __init__(self, texture: UInt8[np.ndarray, "h w 3"]) -> None:
        self._levels = [texture.astype(np.float32) / 255.0]
        while min(self._levels[-1].shape[:2]) > 1:
            h, w = (n // 2 for n in self._levels[-1].shape[:2])
            small = cv2.resize(self._levels[-1], (w, h), interpolation=cv2.INTER_AREA)
            self._levels.append(np.asarray(small, np.float32))

    def sample(
        self, uv: Float[np.ndarray, "n 2"], texels: Float[np.ndarray, " n"]
    ) -> Float32[np.ndarray, "n 3"]:
        """Colours at `uv`, each averaged over about `texels` texels of the full texture."""
        level = np.rint(np.log2(np.maximum(texels, 1.0))).astype(int)
        level = np.minimum(level, len(self._levels) - 1)
        out = np.empty((len(uv), 3), np.float32)
        for k in np.unique(level):
            here = level == k
            out[here] = _bilinear(self._levels[k], uv[here])
        return out


def _bilinear(
    image: Float32[np.ndarray, "h w 3"], uv: Float[np.ndarray, "n 2"]
) -> Float32[np.ndarray, "n 3"]:
    h, w = image.shape[:2]
    x, y = uv[:, 0] * w - 0.5, uv[:, 1] * h - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    a, b = (x - x0)[:, None].astype(np.float32), (y - y0)[:, None].astype(np.float32)
    left, right, top, bottom = x0 % w, (x0 + 1) % w, y0 % h, (y0 + 1) % h
    upper = image[top, left] * (1 - a) + image[top, right] * a
    lower = image[bottom, left] * (1 - a) + image[bottom, right] * a
    return upper * (1 - b) + lower * b
