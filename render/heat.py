"""Difference heat: a body in the colours of its distance from another one."""

from collections.abc import Iterable

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8
from scipy.spatial import KDTree

from render.cameras import Camera
from render.lettering import DARK, text_width, write
from render.scene import Color

Picture = UInt8[np.ndarray, "h w 3"]

HEAT_BODY: Color = (0.90, 0.90, 0.90)
"""A body that is to be tinted is drawn in this colour."""
_STOPS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
_COLORS = np.array(
    [
        [0.93, 0.94, 0.95],
        [1.0, 0.86, 0.45],
        [0.98, 0.58, 0.22],
        [0.84, 0.20, 0.16],
        [0.42, 0.03, 0.18],
    ]
)
"""From pale through yellow and red to dark: lighter is always nearer, also without colours."""
_ROUND = (0.02, 0.05, 0.10, 0.15, 0.20, 0.30, 0.40, 0.60, 0.80, 1.0, 1.5, 2.0)
"""Metres that a scale may end at."""
_NEIGHBOURS = 3


def heat_color(share: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n 3"]:
    """Colours from 0 (no distance) to 1 (the end of the scale, and beyond), each 0 to 1."""
    return np.stack([np.interp(share, _STOPS, _COLORS[:, k]) for k in range(3)], axis=-1)


def heat_scale(distances: Iterable[Float[np.ndarray, "..."]]) -> float:
    """A round end of the scale, metres, that 95 % of some distances stay below."""
    every = np.concatenate([d.ravel() for d in distances])
    most = float(np.quantile(every, 0.95)) if len(every) else 0.0
    return next((end for end in _ROUND if end >= most), _ROUND[-1])


def tinted(
    with_body: tuple[Picture, Float32[np.ndarray, "h w"]],
    without: Float32[np.ndarray, "h w"],
    camera: Camera,
    vertices: Float[np.ndarray, "verts 3"],
    distance: Float[np.ndarray, " verts"],
    scale: float,
) -> Picture:
    """The picture with the body in its heat; what stands before the body keeps its colour.

    Args:
        with_body: colours and depth of the scene, its body drawn in `HEAT_BODY`.
        without: depth of the same scene without the body.
        camera: both were drawn from.
        vertices: the body's, world, metres.
        distance: of each vertex from the other body's, metres.
        scale: metres at the end of the scale.
    """
    rgb, depth = with_body
    body = (depth > 0) & ((without == 0) | (depth < without - 1e-3))
    if not body.any():
        return rgb
    points = _points(camera, depth, body)
    far, near = KDTree(vertices).query(points, k=_NEIGHBOURS)
    weight = 1.0 / np.maximum(far, 1e-4)
    value = (weight * distance[near]).sum(axis=1) / weight.sum(axis=1)
    tint = np.zeros((*body.shape, 3), np.float32)
    tint[body] = heat_color(value / scale) / HEAT_BODY
    # Pixels on the body's outline are partly background: they are tinted in part.
    share = cv2.blur(body.astype(np.float32), (3, 3))[..., None]
    spread = cv2.blur(tint, (3, 3)) / np.maximum(share, 1e-6)
    share = np.where(body[..., None], 1.0, 0.5 * share)
    tint = np.where(body[..., None], tint, spread)
    out = rgb * (1.0 - share + share * tint)
    return np.clip(out, 0.0, 255.0).astype(np.uint8)


def heat_legend(picture: Picture, words: str, scale: float, unit: float) -> None:
    """Draw the scale with its ends in centimetres into the middle of a picture, in place."""
    h, w = picture.shape[:2]
    long, thick = round(9 * unit), round(0.8 * unit)
    ends = ("0", f"{100 * scale:g} cm")
    widths = [text_width(t, unit) + 0.6 * unit for t in (words, *ends)]
    x = 0.5 * (w - sum(widths) - long - 0.8 * unit)
    write(picture, words, (x, h / 2), unit, ink=DARK)
    x += widths[0] + 0.8 * unit
    write(picture, ends[0], (x, h / 2), unit, ink=DARK)
    left, top = round(x + widths[1]), (h - thick) // 2
    bar = 255 * heat_color(np.linspace(0.0, 1.0, long))
    picture[top : top + thick, left : left + long] = bar.astype(np.uint8)
    cv2.rectangle(picture, (left, top), (left + long, top + thick), (170, 170, 172), 1)
    write(picture, ends[1], (left + long + 0.6 * unit, h / 2), unit, ink=DARK)


def _points(
    camera: Camera, depth: Float32[np.ndarray, "h w"], where: np.ndarray
) -> Float[np.ndarray, "pixels 3"]:
    """World points that pixels show."""
    v, u = np.nonzero(where)
    d = depth[where].astype(np.float64)
    seen = np.stack([(u - camera.cx) / camera.fx * d, (camera.cy - v) / camera.fy * d, -d], axis=1)
    return seen @ camera.T_world_camera[:3, :3].T + camera.T_world_camera[:3, 3]
