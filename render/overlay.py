"""A motion drawn into a real film: lens, outline, and what hides it."""

from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8

from render.backends import Backend, open_renderer
from render.cameras import Camera
from render.props import OBJECT_COLOR, Actor
from render.renderer import NEAR, Layer, Renderer
from render.scene import Color, Drawable, Light, Scene
from render.video import ahead

_ROUNDS = 30
"""Most iterations that invert the distortion of a lens."""
_DONE = 1e-5
"""Step of such an iteration that ends them; it is about a hundredth of a pixel."""

Distort = Callable[[Float[np.ndarray, "n 2"]], Float[np.ndarray, "n 2"]]
"""Maps directions x/z, y/z (x right, y down) to where the lens shows them."""


class LensDistortion:
    """A larger picture without distortion, from which the bent one is sampled."""

    def __init__(
        self,
        K: Float[np.ndarray, "3 3"],
        width: int,
        height: int,
        distort: Distort | None,
        *,
        finer: float = 1.5,
    ) -> None:
        """A lens for pictures of one camera.

        Args:
            K: camera matrix, pixels; (0, 0) is the centre of the first.
            width, height: of the bent pictures, pixels.
            distort: the lens; None bends nothing.
            finer: pixels drawn for one of a bent picture, along each axis.
        """
        self._map: tuple[np.ndarray, np.ndarray] | None = None
        self.width, self.height = width, height
        self._pinhole = (K[0, 0], K[1, 1], K[0, 2], K[1, 2])
        if distort is None:
            return
        u, v = np.meshgrid(np.arange(width), np.arange(height))
        bent = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1]], axis=-1).reshape(-1, 2)
        rays = _straightened(bent, distort)
        low, high = rays.min(axis=0) - 0.01, rays.max(axis=0) + 0.01
        focal = finer * np.array([K[0, 0], K[1, 1]])
        self.width, self.height = np.ceil((high - low) * focal).astype(int).tolist()
        self._pinhole = (*focal, *(-low * focal))
        where = ((rays - low) * focal).astype(np.float32).reshape(height, width, 2)
        self._map = where[..., 0], where[..., 1]

    def camera(self, T_world_camera: Float[np.ndarray, "4 4"]) -> Camera:
        """The camera that draws the straight picture, `self.width` x `self.height`; `Camera`'s axes."""
        return Camera(T_world_camera, *self._pinhole)

    def bend(self, picture: UInt8[np.ndarray, "h w c"]) -> UInt8[np.ndarray, "height width c"]:
        """The straight picture as the lens shows it."""
        if self._map is None:
            return picture
        return np.asarray(cv2.remap(picture, *self._map, cv2.INTER_LINEAR), np.uint8)


def _straightened(bent: Float[np.ndarray, "n 2"], distort: Distort) -> Float[np.ndarray, "n 2"]:
    """Directions that the lens bends to these, by going back what it moves them."""
    rays = bent.copy()
    for _ in range(_ROUNDS):
        back = bent - distort(rays)
        rays += back
        if np.abs(back).max() < _DONE:
            break
    return rays


_SHIFT = 4
"""Bits of a pixel that OpenCV fills to."""


def pixels_of(
    points: Float[np.ndarray, "n 3"], camera: Camera, distort: Distort | None
) -> Float[np.ndarray, "n 3"]:
    """Pixel u, v and depth of world points through a lens; behind the camera u, v mean nothing."""
    pixels = camera.project(points)
    if distort is None:
        return pixels
    scale, middle = np.array([camera.fx, camera.fy]), np.array([camera.cx, camera.cy])
    ahead = pixels[:, 2] > NEAR
    pixels[ahead, :2] = distort((pixels[ahead, :2] - middle) / scale) * scale + middle
    return pixels


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
    pixels = pixels_of(vertices, camera, distort)
    whole = (pixels[faces, 2] > NEAR).all(axis=1)
    # What is far outside would overflow the integers that OpenCV counts in.
    flat = np.clip(pixels[:, :2], -2 * max(height, width), 3 * max(height, width))
    corners = np.rint(flat * 2**_SHIFT).astype(np.int32)[faces[whole]]
    mask = np.zeros((height, width), np.uint8)
    for corner in corners:
        cv2.fillConvexPoly(mask, corner, 255, shift=_SHIFT)
    rims: Sequence[np.ndarray] = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0]
    ink = tuple(255.0 * c for c in color)
    cv2.drawContours(picture, rims, -1, ink, max(1, round(height / 360)), cv2.LINE_AA)


RGB = UInt8[np.ndarray, "h w 3"]
ObjectStyle = Literal["drawn", "outline", "hidden"]

_FLOOR = 8.0
"""Metres from the origin of what moves to where the floor that catches shadows ends."""
_SUN = Light(elevation=1.2, sky=0.62)
"""More a lamp above than a sun: where a room's light comes from is not known."""
_WIPE = 6.0
"""Seconds that the line of before and after takes there and back."""


@dataclass(frozen=True)
class OverlayStyle:
    """What of the motion is drawn, and how."""

    thing: ObjectStyle = "outline"
    """The object: drawn over the real one, as its outline, or not at all. In any case it hides what
    is behind it."""
    opacity: float = 1.0
    """Opacity of what is drawn, 0 to 1."""
    wipe: bool = False
    """A line that goes to and fro: on its left the film as it is."""
    turns: int = 0
    """Quarter turns counter-clockwise that bring the pictures upright at the end."""
    mirrored: bool = False
    """Left and right change places before that."""


def overlay(
    film: Iterable[tuple[int, RGB]],
    cameras: Sequence[Camera],
    person: Actor,
    thing: Actor,
    *,
    distort: Distort | None = None,
    fps: float = 30.0,
    style: OverlayStyle = OverlayStyle(),
    backend: Backend = "auto",
    samples: int = 4,
) -> Generator[tuple[int, RGB]]:
    """The film's pictures with a person in them; the film is decoded while others are drawn.

    Args:
        film: pictures, each with the place of its camera; the same places are given back.
        cameras: what took each; of one focal length and centre where a lens bends the pictures.
        person, thing: whose frames are the film's pictures; the object is posed by `T_world`.
        distort: the camera's lens.
        fps: of the film, for the wipe.
        style: see there.
        backend, samples: see `open_renderer`.
    """
    pictures = ahead(film)
    first = next(pictures, None)
    if first is None:
        return
    height, width = first[1].shape[:2]
    fixed = cameras[0]
    K = np.array([[fixed.fx, 0, fixed.cx], [0, fixed.fy, fixed.cy], [0, 0, 1.0]])
    lens = LensDistortion(K, width, height, distort, finer=1.0) if distort else None
    size = (lens.width, lens.height) if lens else (width, height)
    with open_renderer(*size, backend, samples=samples) as renderer:
        renderer.show(_scene(person, thing, style))
        for frame, picture in chain([first], pictures):
            person.pose(renderer, frame)
            thing.pose(renderer, frame)
            layer = _layer(renderer, cameras[frame], lens)
            under = picture
            if style.thing == "outline":
                under = _outlined(picture, thing, frame, cameras[frame], distort)
            done = _as_shown(composite(under, layer, style.opacity), style)
            if style.wipe:
                done = wiped(_as_shown(picture, style), done, frame / fps)
            yield frame, np.ascontiguousarray(done)


def _as_shown(picture: RGB, style: OverlayStyle) -> UInt8[np.ndarray, "height width 3"]:
    return np.rot90(picture[:, ::-1] if style.mirrored else picture, style.turns)


def _layer(renderer: Renderer, camera: Camera, lens: LensDistortion | None) -> Layer:
    if lens is None:
        return renderer.layer(camera)
    return lens.bend(renderer.layer(lens.camera(camera.T_world_camera)))


def _scene(person: Actor, thing: Actor, style: OverlayStyle) -> Scene:
    """Floor and object as things of the film, unless the object is drawn."""
    assert thing.T_world is not None
    there = style.thing == "drawn"
    solid = replace(thing.drawable, real=not there, casts_shadow=there)
    middle = np.append(np.median(thing.T_world[:, :2, 3], axis=0), 0.0)
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    ground = Drawable(
        "ground",
        middle + _FLOOR * square,
        np.array([[0, 1, 2], [0, 2, 3]]),
        casts_shadow=False,
        real=True,
    )
    return Scene([ground, person.drawable, solid], background=None, light=_SUN)


def _outlined(
    picture: RGB, thing: Actor, frame: int, camera: Camera, distort: Distort | None
) -> RGB:
    assert thing.T_world is not None
    T = thing.T_world[frame]
    points = thing.drawable.vertices @ T[:3, :3].T + T[:3, 3]
    out = picture.copy()
    draw_outline(out, points, thing.drawable.faces, camera, distort, OBJECT_COLOR)
    return out


def composite(under: RGB, layer: Layer, opacity: float = 1.0) -> RGB:
    """A layer over a picture of the same size; where its alpha is 0 the picture stays, bit by bit."""
    out = under.copy()
    x, y, w, h = cv2.boundingRect(layer[..., 3])
    part = layer[y : y + h, x : x + w].astype(np.float32) * np.float32(opacity)
    clear = np.float32(1.0) - part[..., 3:] / np.float32(255.0)
    mixed = part[..., :3] + clear * under[y : y + h, x : x + w]
    out[y : y + h, x : x + w] = (mixed + np.float32(0.5)).clip(0, 255).astype(np.uint8)
    return out


def wiped(before: RGB, after: RGB, seconds: float) -> RGB:
    """`before` left of a white line that goes to and fro, `after` right of it."""
    width = before.shape[1]
    share = 0.5 - 0.5 * float(np.cos(2 * np.pi * seconds / _WIPE))
    at = round((0.1 + 0.8 * share) * width)
    out = after.copy()
    out[:, :at] = before[:, :at]
    line = max(1, round(width / 640))
    out[:, at : at + line] = 255
    return out
