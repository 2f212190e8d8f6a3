"""Pictures as the bytes of PNG or JPEG files, for containers such as GLB and npz."""

from io import BytesIO
from typing import NamedTuple

import numpy as np
from jaxtyping import UInt8
from PIL import Image

_LARGE = 1_000_000
"""Bytes beyond which a PNG, most likely of a photograph, becomes a JPEG."""
_QUALITY = 92


class PictureBytes(NamedTuple):
    """A picture file in memory."""

    data: bytes
    ending: str
    """png or jpg."""

    @property
    def mime(self) -> str:
        """The kind's name in HTTP and glTF."""
        return {"png": "image/png", "jpg": "image/jpeg"}[self.ending]


def encoded(image: UInt8[np.ndarray, "h w 3"]) -> PictureBytes:
    """The picture as PNG, or as JPEG where that would be large."""
    picture, png, jpeg = Image.fromarray(image), BytesIO(), BytesIO()
    picture.save(png, "PNG")
    if png.tell() <= _LARGE:
        return PictureBytes(png.getvalue(), "png")
    picture.save(jpeg, "JPEG", quality=_QUALITY)
    return PictureBytes(jpeg.getvalue(), "jpg")


def decoded(data: bytes) -> UInt8[np.ndarray, "h w 3"]:
    """The picture in such bytes."""
    return np.asarray(Image.open(BytesIO(data)).convert("RGB"))
