"""The outline of a surface in a picture of a real camera, without drawing the surface."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8

from render.cameras import Camera
from render.lens import Distort
from render.renderer import NEAR
from render.scene import Color

_SHIFT = 4
"""Bits of a pixel that OpenCV fills to."""


def pixels_of(
    points: Float[np.ndarray, "n 3"], camera: Camera, distort: Distort | None
) -> Float[np.ndarray, "n 3"]:
    """Pixel u, v and depth of world points through a lens; behind the camera u, v mean nothing."""
    seen = camera.project(points)
    if distort is None:
        return seen
    scale, middle = np.array([camera.fx, camera.fy]), np.array([camera.cx, camera.cy])
    ahead = seen[:, 2] > NEAR
    seen[ahead, :2] = distort((seen[ahead, :2] - middle) / scale) * scale + middle
    return seen


def draw_outline(
    picture: UInt8[np.ndarray, "h w 3"],
    vertices: Float[np.ndarray, "verts 3"],
    faces: Int[np.ndarray, "faces 3"],
    camera: Camera,
    distort: Distort | None,
    color: Color,
) -> None:
    """Draw the rim of a surface into a picture.

    Args:
        picture: changed in place.
        vertices: world, metres.
        faces: of the surface.
        camera, distort: what took the picture.
        color: of the line.
    """
    height, width = picture.shape[:2]
    seen = pixels_of(vertices, camera, distort)
    whole = (seen[faces, 2] > NEAR).all(axis=1)
    # What is far outside would overflow the integers that OpenCV counts in.
    flat = np.clip(seen[:, :2], -2 * max(height, width), 3 * max(height, width))
    corners = np.rint(flat * 2**_SHIFT).astype(np.int32)[faces[whole]]
    mask = np.zeros((height, width), np.uint8)
    for corner in corners:
        cv2.fillConvexPoly(mask, corner, 255, shift=_SHIFT)
    rims: Sequence[np.ndarray] = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0]
    ink = tuple(255.0 * c for c in color)
    cv2.drawContours(picture, rims, -1, ink, max(1, round(height / 360)), cv2.LINE_AA)
