"""What is drawn: surfaces with their normals, and the light on them.

What is drawn: surfaces and the light on them. Both backends draw from this and nothing else.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import trimesh
from jaxtyping import Float, Float32, Int, UInt8
from scipy import sparse

from omomo_core.geometry.surface import SplitSurface, split_creases

Color = tuple[float, float, float]
"""Red, green, blue as shown on the screen, 0 to 1."""

BACKGROUND: Color = (0.925, 0.918, 0.905)


@dataclass(frozen=True)
class Drawable:
    """One surface with smooth normals, seen from both sides."""

    name: str
    vertices: Float[np.ndarray, "verts 3"]
    """In the drawable's own frame, metres; that frame is the world until an update moves it."""
    faces: Int[np.ndarray, "faces 3"]
    color: Color = (1.0, 1.0, 1.0)
    """Multiplied with the texture when there is one."""
    uv: Float[np.ndarray, "verts 2"] | None = None
    """Texture coordinates: (0, 0) is the texture's top left corner, (1, 1) its bottom right."""
    texture: UInt8[np.ndarray, "h w 3"] | None = None
    casts_shadow: bool = True
    closed: bool = False
    """No hole lets its inside be seen, and its faces look outwards: those that look away need no drawing."""
    real: bool = False
    """A thing of the film that the picture is laid over: it hides what is behind it, and shows nothing
    but the shadows that fall on it."""


@dataclass(frozen=True)
class Light:
    """One sun and the glow of the sky; level ground in the sun shows its own colour unchanged."""

    azimuth: float = -1.0
    """Azimuth of the sun, counter-clockwise from +x, radians."""
    elevation: float = 0.9
    sky: float = 0.68
    """Light on a surface facing up in the shadow, 0 to 1."""
    ground: float = 0.50
    """Light on a surface facing down."""

    @property
    def to_sun(self) -> Float[np.ndarray, " 3"]:
        """Unit vector toward the sun."""
        level = np.cos(self.elevation)
        x, y = level * np.cos(self.azimuth), level * np.sin(self.azimuth)
        return np.array([x, y, np.sin(self.elevation)])

    @property
    def sun(self) -> float:
        """Strength of the sun on a surface that faces it."""
        return float((1.0 - self.sky) / np.sin(self.elevation))


@dataclass(frozen=True)
class Scene:
    """Everything a renderer is shown at once; names of drawables are unique."""

    drawables: Sequence[Drawable]
    background: Color | None = BACKGROUND
    """None is transparent, see `Renderer.layer`."""
    light: Light = field(default_factory=Light)


CREASE = np.radians(35.0)
"""Faces that meet at a sharper angle keep a hard edge."""


class VertexNormals:
    """Area-weighted smooth normals of a mesh whose faces stay and whose vertices move."""

    def __init__(self, faces: Int[np.ndarray, "faces 3"], count: int) -> None:
        self._corners = [np.ascontiguousarray(faces[:, k]) for k in range(3)]
        column = np.repeat(np.arange(len(faces)), 3)
        ones = np.ones(len(column), np.float32)
        self._gather = sparse.csr_matrix((ones, (faces.ravel(), column)), (count, len(faces)))

    def __call__(self, vertices: Float[np.ndarray, "verts 3"]) -> Float32[np.ndarray, "verts 3"]:
        """Unit normals; zero where a vertex has no face with an area."""
        x = vertices.astype(np.float32, copy=False)
        a, b, c = (x.take(corner, axis=0) for corner in self._corners)
        total = self._gather @ _cross(b - a, c - a)
        length = np.sqrt(np.einsum("ij,ij->i", total, total))[:, None]
        return (total / np.maximum(length, 1e-20)).astype(np.float32, copy=False)


def _cross(
    a: Float32[np.ndarray, "n 3"], b: Float32[np.ndarray, "n 3"]
) -> Float32[np.ndarray, "n 3"]:
    """Cross products, in a third of the time that numpy's take."""
    out = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        out[:, i] = a[:, j] * b[:, k] - a[:, k] * b[:, j]
    return out


def split_mesh(
    vertices: Float[np.ndarray, "verts 3"],
    faces: Int[np.ndarray, "faces 3"],
    uv: Float[np.ndarray, "faces 3 2"] | None = None,
) -> SplitSurface:
    """The surface of a mesh for drawing: equal vertices are one, and those on creases are doubled."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    return split_creases(np.asarray(mesh.vertices), np.asarray(mesh.faces), CREASE, uv)
