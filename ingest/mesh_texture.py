"""Pictures on surfaces: base colours of materials, several joined to one texture, and sRGB."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image

from omomo_core.errors import DamageError
from omomo_core.motion import Texture

MOST_PIXELS = 8192 * 8192
"""Most pixels of the pictures of a file together: phone apps paint no larger ones."""
MOST_SIDE = 2048
"""Larger pictures are made smaller: an object fills a part of a screen."""
_PATCH = 8
"""Pixels along each side of a patch of one colour, for a part without a picture."""
_GREY = (178, 178, 178)

Pixels = UInt8[np.ndarray, "h w 3"]


@dataclass(frozen=True)
class TexturedPart:
    """Triangles that have one material, wherever they stand."""

    corners: Float[np.ndarray, "faces 3 3"]
    uv: Float[np.ndarray, "faces 3 2"]
    """(0, 0) is the picture's top left corner."""
    image: Pixels


@dataclass(frozen=True)
class BaseColour:
    """The base colour of a material, decoded when it is asked for."""

    image: Image.Image
    factor: tuple[float, float, float] | None = None
    """What its linear values are multiplied with, 0 to 1; None leaves them."""

    def pixels(self, side: int = MOST_SIDE) -> Pixels:
        """The picture, made smaller where a side is longer than so many pixels.

        Raises:
            ValueError: it has more than MOST_PIXELS.
            OSError, SyntaxError: it is damaged.
        """
        return _tinted(pixels_of(self.image, side), self.factor)


def patch(colour: Sequence[int] | np.ndarray = _GREY) -> Pixels:
    """A small picture of one colour, for a part without a picture."""
    return np.tile(np.asarray(colour, np.uint8), (_PATCH, _PATCH, 1))


def pixels_of(image: Image.Image, side: int = MOST_SIDE) -> Pixels:
    """The pixels of a picture, which is made smaller if a side is longer than so many.

    Raises:
        ValueError: it has more than MOST_PIXELS.
    """
    if image.width * image.height > MOST_PIXELS:
        raise DamageError("the picture is too large")
    shown = image.convert("RGB")
    shown.thumbnail((side, side))
    return np.asarray(shown, np.uint8)


def _tinted(pixels: Pixels, factor: Sequence[float] | None) -> Pixels:
    """glTF multiplies the linear values of the picture with this factor, 0 to 1."""
    if factor is None:
        return pixels
    table = to_srgb(to_linear(np.arange(256))[:, None] * np.asarray(factor, float)[:3])
    return np.stack([table[:, k][pixels[..., k]] for k in range(3)], axis=-1)


def to_linear(colours: np.ndarray) -> Float[np.ndarray, "..."]:
    """Linear values, 0 to 1, of sRGB bytes."""
    s = np.asarray(colours, float) / 255.0
    return np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: np.ndarray) -> UInt8[np.ndarray, "..."]:
    """Bytes of sRGB, as pictures and screens have them, of linear values, 0 to 1."""
    value = np.clip(np.nan_to_num(np.asarray(linear, float)), 0.0, 1.0)
    back = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.rint(255.0 * back).astype(np.uint8)


def fits(pictures: list[BaseColour]) -> bool:
    """Whether pictures are few and small enough to be decoded."""
    return sum(one.image.width * one.image.height for one in pictures) <= MOST_PIXELS


def texture_colours(texture: Texture) -> UInt8[np.ndarray, "faces 3 3"]:
    """The colours of a texture at the corners of its triangles."""
    height, width = texture.image.shape[:2]
    places = (texture.uv % 1.0 * [width, height]).astype(np.int64)
    return texture.image[places[..., 1], places[..., 0]]


def join_textures(parts: Sequence[TexturedPart]) -> Texture:
    """One texture of all parts, their triangles in order: the pictures below each other."""
    images = list({id(part.image): part.image for part in parts}.values())
    if len(images) == 1:
        return Texture(np.concatenate([part.uv for part in parts]), images[0])
    shrink = min(1.0, 2 * MOST_SIDE / sum(len(image) for image in images))
    rows = [max(2, round(len(image) * shrink)) for image in images]
    width = max(max(2, round(image.shape[1] * shrink)) for image in images)
    scaled = [
        np.asarray(Image.fromarray(image).resize((width, height)))
        for image, height in zip(images, rows, strict=True)
    ]
    top = dict(zip(map(id, images), np.cumsum([0, *rows[:-1]]).tolist(), strict=True))
    height = {id(image): count for image, count in zip(images, rows, strict=True)}
    uv = [_moved(part.uv, top[id(part.image)], height[id(part.image)], sum(rows)) for part in parts]
    return Texture(np.concatenate(uv), np.concatenate(scaled))


def _moved(
    uv: Float[np.ndarray, "faces 3 2"], top: int, height: int, total: int
) -> Float[np.ndarray, "faces 3 2"]:
    """Places on one picture of several: one that repeats does so no more, so wrap each triangle."""
    once = uv - np.floor(uv.min(axis=1, keepdims=True) + 1e-6)
    edge = 0.5 / height  # half a pixel, so that no neighbour shines through
    v = np.clip(once[..., 1], edge, 1.0 - edge)
    return np.stack([once[..., 0], (top + v * height) / total], axis=-1)
