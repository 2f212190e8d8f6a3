"""Renderer: draws a Scene from a camera. Opened by `backends.open_renderer`."""

from abc import ABC, abstractmethod
from types import TracebackType

import cv2
import numpy as np
from jaxtyping import Float, Float32, UInt8

from render.cameras import Camera
from render.scene import Scene

Picture = tuple[UInt8[np.ndarray, "h w 3"], Float32[np.ndarray, "h w"]]
"""Colours (RGB), and depth along the viewing axis in metres (0 where nothing is)."""

Layer = UInt8[np.ndarray, "h w 4"]
"""Colours (RGB) that have been multiplied with the alpha that follows them."""

NEAR = 0.05
"""Least depth that is drawn, metres."""
FAR = 100.0
"""Most depth that is drawn, metres."""


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
