"""Renderer: draws a Scene from a camera. Opened by `open_renderer`, which picks a backend."""

import logging
from abc import ABC, abstractmethod
from types import TracebackType
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from omomo_core.errors import InputError
from render.cameras import Camera
from render.scene import Scene

Backend = Literal["auto", "pyrender", "raycast"]
Picture = tuple[UInt8[np.ndarray, "h w 3"], Float32[np.ndarray, "h w"]]
"""Colours (RGB), and depth along the viewing axis in metres (0 where nothing is)."""

Layer = UInt8[np.ndarray, "h w 4"]
"""Colours (RGB) that have been multiplied with the alpha that follows them."""

NEAR, FAR = 0.05, 100.0
"""Nothing nearer or farther than this many metres of depth is drawn."""

_log = logging.getLogger(__name__)


class Renderer(ABC):
    """Draws pictures of one size. Use it as a context manager, in the thread that opened it."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height

    @abstractmethod
    def show(self, scene: Scene) -> None:
        """Draw this scene from now on, in place of the one before."""

    @abstractmethod
    def update(
        self,
        name: str,
        *,
        vertices: Float[np.ndarray, "verts 3"] | None = None,
        T_world: Float[np.ndarray, "4 4"] | None = None,
        color: Float[np.ndarray, " 3"] | None = None,
        visible: bool | None = None,
    ) -> None:
        """Change the drawable `name` in place; what is None stays.

        Args:
            name: of a drawable of the scene shown (KeyError otherwise).
            vertices: as many as before, in the drawable's frame, metres; normals follow.
            T_world: pose of the drawable's frame in the world (rotation and translation).
            color: red, green, blue, 0 to 1.
            visible: whether it is drawn and throws its shadow.
        """

    @abstractmethod
    def draw(self, camera: Camera) -> Picture:
        """The scene as the camera sees it."""

    @abstractmethod
    def layer(self, camera: Camera) -> Layer:
        """The same without its depth, to be laid over another picture: layer + (1 - alpha) * other."""

    def color(self, camera: Camera) -> UInt8[np.ndarray, "h w 3"]:
        """The colours (RGB) of the scene as the camera sees it; faster than `draw`."""
        return np.asarray(cv2.cvtColor(self.layer(camera), cv2.COLOR_RGBA2RGB), np.uint8)

    @abstractmethod
    def close(self) -> None:
        """Free what it holds; nothing can be drawn afterwards."""

    def __enter__(self) -> "Renderer":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def open_renderer(
    width: int, height: int, backend: Backend = "auto", *, samples: int = 4
) -> Renderer:
    """A renderer for pictures of `width` x `height` pixels.

    Args:
        width, height: size of the pictures in pixels.
        backend: "pyrender" draws with OpenGL through EGL, no display needed; "raycast" needs no
            OpenGL at all but has jagged edges and hard shadows; "auto" takes the first that works.
        samples: multisampling of "pyrender": 4 smooths edges and takes half as long again; 0 is
            none. "raycast" shoots one ray a pixel.

    Raises:
        InputError: "pyrender" was asked for and OpenGL cannot be opened.
    """
    if backend != "raycast":
        try:
            from render.pyrender_backend import PyrenderRenderer

            return PyrenderRenderer(width, height, samples)
        except Exception as error:  # missing libraries and drivers fail in a dozen different ways
            if backend == "pyrender":
                raise InputError(
                    "no-opengl",
                    f"OpenGL could not be opened through EGL: {error}.",
                    fix="Install the apt packages libegl1 and libgl1, or choose backend raycast.",
                ) from error
            _log.warning(
                "OpenGL is not available (%s); drawing with the slower ray caster. "
                "The apt packages libegl1 and libgl1 bring OpenGL.",
                error,
            )
    from render.raycast_backend import RaycastRenderer

    return RaycastRenderer(width, height)
