"""The things on the stage (floor, object, markers, trail), and actors that move.

The things on the stage: floor, object, markers, trail. Their look is decided here.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.spatial.transform import Rotation, Slerp

from omomo_core.errors import InputError
from omomo_core.motion import ObjectMesh, ObjectMotion
from render.cameras import Camera
from render.renderer import Renderer
from render.scene import BACKGROUND, Color, Drawable, split_mesh

Vertices = Callable[[int], Float[np.ndarray, "verts 3"]]


@dataclass(frozen=True)
class Actor:
    """A drawable and what changes of it from frame to frame; what is None stays as it is."""

    drawable: Drawable
    vertices: Callable[[int], Float[np.ndarray, "verts 3"]] | None = None
    """Vertices at a frame; of an array (frames, verts, 3) pass its `__getitem__`."""
    T_world: Float[np.ndarray, "frames 4 4"] | None = None
    """Pose of the drawable's frame in the world."""
    color: Float[np.ndarray, "frames 3"] | None = None
    visible: Bool[np.ndarray, " frames"] | None = None

    def pose(self, renderer: Renderer, frame: int) -> None:
        """Bring the drawable in `renderer` to `frame`."""
        renderer.update(
            self.drawable.name,
            vertices=None if self.vertices is None else self.vertices(frame),
            T_world=None if self.T_world is None else self.T_world[frame],
            color=None if self.color is None else self.color[frame],
            visible=None if self.visible is None else bool(self.visible[frame]),
        )


def play(
    renderer: Renderer,
    actors: Sequence[Actor],
    cameras: Sequence[Camera],
    only: Sequence[int] | None = None,
) -> Iterator[UInt8[np.ndarray, "h w 3"]]:
    """One picture per camera: frame i of every actor seen from `cameras[i]`.

    The renderer must be showing a scene that holds the actors' drawables. `only` names the frames to
    draw; without it, all are drawn.
    """
    for frame in range(len(cameras)) if only is None else only:
        for actor in actors:
            actor.pose(renderer, frame)
        yield renderer.color(cameras[frame])


def retimed(actor: Actor, at: Float[np.ndarray, " pictures"], count: int) -> Actor:
    """The actor whose k-th frame is what `actor` does at its frame `at[k]`, a whole number or not.

    Vertices and positions go straight and rotations evenly from frame to frame; colour and
    visibility are those of the nearest frame. Before the first of its `count` frames and after the
    last it rests.
    """
    at = np.clip(at, 0.0, count - 1.0)
    nearest = np.rint(at).astype(int)
    return replace(
        actor,
        vertices=None if actor.vertices is None else _between(actor.vertices, at),
        T_world=None if actor.T_world is None else poses_at(actor.T_world, at),
        color=None if actor.color is None else actor.color[nearest],
        visible=None if actor.visible is None else actor.visible[nearest],
    )


def poses_at(
    T: Float[np.ndarray, "frames 4 4"], at: Float[np.ndarray, " pictures"]
) -> Float[np.ndarray, "pictures 4 4"]:
    """Poses between frames: moved straight and turned evenly from one to the next."""
    if len(T) == 1:
        return np.tile(T, (len(at), 1, 1))
    known = np.arange(len(T))
    out = np.tile(np.eye(4), (len(at), 1, 1))
    out[:, :3, :3] = Slerp(known, Rotation.from_matrix(T[:, :3, :3]))(at).as_matrix()
    for axis in range(3):
        out[:, axis, 3] = np.interp(at, known, T[:, axis, 3])
    return out


def _between(vertices: Vertices, at: Float[np.ndarray, " pictures"]) -> Vertices:
    def moved(picture: int) -> Float[np.ndarray, "verts 3"]:
        before = int(np.floor(at[picture]))
        share = at[picture] - before
        start = vertices(before)
        return start if share == 0 else (1 - share) * start + share * vertices(before + 1)

    return moved


BODY_COLOR: Color = (0.42, 0.56, 0.74)
OBJECT_COLOR: Color = (0.87, 0.60, 0.33)
LOST_COLOR: Color = (0.72, 0.70, 0.68)
TRAIL_COLOR: Color = (0.80, 0.45, 0.22)
FREE_COLOR: Color = (0.78, 0.79, 0.80)
CONTACT_COLOR: Color = (0.27, 0.68, 0.45)

_TILE = np.array([0.895, 0.885, 0.868])
_CHECKER = 0.014
_LINE = 0.075
_LINE_WIDTH = 0.022


def floor(
    low: Float[np.ndarray, " 2"], high: Float[np.ndarray, " 2"], *, margin: float = 3.5
) -> Drawable:
    """A floor at z = 0 with a line every metre of the world's grid, fading into the background.

    Args:
        low, high: corners of the ground that is used, x y in metres.
        margin: how far the floor reaches beyond it before it has faded away, metres.
    """
    a, b = np.floor(np.asarray(low) - margin), np.ceil(np.asarray(high) + margin)
    sides = [_texture_side(length) for length in b - a]
    step = (b - a) / sides
    # Single precision, and one row and one column as long as they do: the texture has millions of
    # texels.
    x, y = (
        (a[k] + step[k] * (np.arange(sides[k]) + 0.5)).astype(np.float32).reshape(shape)
        for k, shape in ((0, (1, -1)), (1, (-1, 1)))
    )
    shade = np.float32(_CHECKER) * ((np.floor(x) + np.floor(y)) % 2 - np.float32(0.5))
    line = np.float32(0.5 * max(_LINE_WIDTH, 1.2 * step.max()))
    near_line = (np.abs(x - np.rint(x)) < line) | (np.abs(y - np.rint(y)) < line)
    shade[near_line] -= np.float32(_LINE)
    beyond = np.hypot(_outside(x, low[0], high[0]), _outside(y, low[1], high[1])) / margin
    fade = np.clip((beyond - 0.25) / 0.75, 0.0, 1.0, dtype=np.float32)
    fade = (fade * fade * (3.0 - 2.0 * fade))[..., None]
    tile = _TILE.astype(np.float32) + shade[..., None]
    color = tile + (np.array(BACKGROUND, np.float32) - tile) * fade
    corners = np.array([[a[0], a[1], 0], [b[0], a[1], 0], [b[0], b[1], 0], [a[0], b[1], 0]])
    return Drawable(
        name="floor",
        vertices=corners,
        faces=np.array([[0, 1, 2], [0, 2, 3]]),
        uv=np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]),
        texture=(color * np.float32(255.0) + np.float32(0.5)).astype(np.uint8),
        casts_shadow=False,
    )


def rigid_object(motion: ObjectMotion, color: Color = OBJECT_COLOR) -> Actor:
    """The object along its path, its sharp edges kept sharp; grey where its pose is a guess.

    Raises:
        InputError: "object-no-faces" when its mesh is points alone.
    """
    if len(motion.mesh.faces) == 0:
        raise InputError(
            "object-no-faces",
            f"The object {motion.mesh.name!r} has no faces: there is no surface to draw.",
            fix="Run the take again with a mesh of triangles as ‹object›.",
        )
    drawable = solid(motion.mesh, color)
    return Actor(
        drawable,
        T_world=motion.T_world_object,
        color=np.where(motion.valid[:, None], drawable.color, LOST_COLOR),
    )


def solid(mesh: ObjectMesh, color: Color = OBJECT_COLOR, name: str = "object") -> Drawable:
    """An object with its texture, or in this colour where it has none."""
    texture = mesh.texture
    surface = split_mesh(mesh.vertices, mesh.faces, None if texture is None else texture.uv)
    if texture is None:
        return Drawable(name, surface.vertices, surface.faces, color)
    return Drawable(name, surface.vertices, surface.faces, uv=surface.uv, texture=texture.image)


def contact_marker(
    name: str,
    position: Float[np.ndarray, "frames 3"],
    contact: Float[np.ndarray, " frames"],
    radius: float = 0.038,
) -> Actor:
    """A small ball that turns from grey to green with the probability of contact."""
    vertices, faces = ball(radius)
    T_world = np.tile(np.eye(4), (len(position), 1, 1))
    T_world[:, :3, 3] = position
    share = np.clip(contact, 0.0, 1.0)[:, None]
    color = (1.0 - share) * np.array(FREE_COLOR) + share * np.array(CONTACT_COLOR)
    drawable = Drawable(name, vertices, faces, FREE_COLOR, casts_shadow=False)
    return Actor(drawable, T_world=T_world, color=color)


def trail(
    path: Float[np.ndarray, "frames 3"],
    radius: float = 0.007,
    *,
    name: str = "trail",
    color: Color = TRAIL_COLOR,
) -> Actor:
    """The way a point has come so far: a thin tube that grows with the frames."""
    every = 1 + len(path) // 600
    stops = np.minimum(np.arange(0, len(path) - 1 + every, every), len(path) - 1)
    sides = 6
    rings = path[:, None] + radius * _around(path, sides)
    faces = _tube_faces(len(stops), sides)

    def grown(frame: int) -> Float[np.ndarray, "verts 3"]:
        # Rings that lie ahead wait at the tip: the buffers keep their size.
        return rings[np.minimum(stops, frame)].reshape(-1, 3)

    drawable = Drawable(name, grown(0), faces, color, casts_shadow=False)
    return Actor(drawable, vertices=grown)


def _outside(x: Float[np.ndarray, "*n"], low: float, high: float) -> Float[np.ndarray, "*n"]:
    """Return how far x lies outside an interval, 0 inside."""
    return np.maximum(np.maximum(low - x, x - high), 0.0)


def _texture_side(metres: float) -> int:
    """Texels along a side: about one per centimetre, within what every graphics card takes."""
    return int(np.clip(2 ** np.ceil(np.log2(100.0 * metres)), 256, 2048))


def ball(radius: float) -> tuple[Float[np.ndarray, "verts 3"], Int[np.ndarray, "faces 3"]]:
    """Vertices and faces of a ball around the origin; `radius` in metres."""
    rows, columns = 9, 16
    lat, lon = np.meshgrid(
        np.linspace(-0.5 * np.pi, 0.5 * np.pi, rows),
        np.linspace(0.0, 2.0 * np.pi, columns, endpoint=False),
        indexing="ij",
    )
    level = np.cos(lat)
    points = np.stack([level * np.cos(lon), level * np.sin(lon), np.sin(lat)], axis=-1)
    return radius * points.reshape(-1, 3), _tube_faces(rows, columns)


def _tube_faces(rings: int, sides: int) -> Int[np.ndarray, "faces 3"]:
    """Triangles between consecutive rings of `sides` vertices each."""
    ring, side = np.meshgrid(np.arange(rings - 1), np.arange(sides), indexing="ij")
    here, after = ring * sides + side, ring * sides + (side + 1) % sides
    low = np.stack([here, after, after + sides], axis=-1)
    high = np.stack([here, after + sides, here + sides], axis=-1)
    return np.concatenate([low, high], axis=-1).reshape(-1, 3)


def _around(path: Float[np.ndarray, "frames 3"], sides: int) -> Float[np.ndarray, "frames sides 3"]:
    """Unit vectors square to the path, turned around it."""
    along = np.gradient(path, axis=0) if len(path) > 1 else np.zeros_like(path)
    along = along + np.array([1e-9, 0.0, 0.0])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    steep = np.abs(along[:, 2:]) > 0.9
    across = np.cross(along, np.where(steep, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(along, across)
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)[:, None]
    return np.cos(angle) * across[:, None] + np.sin(angle) * up[:, None]
