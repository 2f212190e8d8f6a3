"""A room with an object to scan, the known poses of the phone that films it, and its mount."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float64, UInt8
from scipy.spatial.transform import Rotation

from ingest.mount import Mount
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh
from render.backends import open_renderer
from render.cameras import Camera, orbit
from render.phone_view import ROOM_LIGHT, busy_texture, room
from render.renderer import Picture
from render.scene import Drawable, Scene
from tests.simulator.scan_objects import OBJECTS
from tests.simulator.scan_shapes import joined

ROOM = np.array([[-2.6, -2.3, 0.0], [2.4, 2.5, 2.7]])
"""Its lowest and highest corner, metres."""
_FOCAL = 1460 / 1920
"""In widths of the picture."""


@dataclass(frozen=True)
class ScanScene:
    """What there is to film, in a world with z up and the floor at 0."""

    mesh: ObjectMesh
    """The thing, in its own frame; the mesh's name is that of the thing."""
    T_world_object: Float64[np.ndarray, "4 4"]
    mount: Mount
    """Where the thing is to the phone once it is clamped: what a calibration is to find."""
    seed: int
    """Of what everything is painted with."""
    contrast: float = 1.0
    """Of the paint on the thing: 0 is one even colour."""
    beside: tuple[Drawable, ...] = ()
    """What else stands or lies in the room, in the world."""

    @cached_property
    def drawables(self) -> tuple[Drawable, ...]:
        """The room and the thing in it."""
        R, t = self.T_world_object[:3, :3], self.T_world_object[:3, 3]
        rng = np.random.default_rng(self.seed)
        painted = [
            replace(part, vertices=part.vertices @ R.T + t, texture=self._paint(rng))
            for part in OBJECTS[self.mesh.name]()
        ]
        return (*room(ROOM[0], ROOM[1], self.seed), *painted, *self.beside)

    def _paint(self, rng: np.random.Generator) -> UInt8[np.ndarray, "h w 3"]:
        paint = busy_texture(rng, 512)
        even = paint.mean(axis=(0, 1))
        return (even + self.contrast * (paint - even)).astype(np.uint8)

    @property
    def T_world_clamped(self) -> Float64[np.ndarray, "4 4"]:
        """The clamped phone's camera."""
        return self.T_world_object @ inverse(self.mount.T_phone_object)


def scan_scene(seed: int, thing: str = "chair", *, contrast: float = 1.0) -> ScanScene:
    """A thing somewhere in a room, and a phone behind it, looking away from it.

    Args:
        seed: of the thing's place, of the clamp, and of what everything is painted with.
        thing: one of `OBJECTS`; the clamp is made for the back of the chair.
        contrast: of the paint on the thing, 0 to 1.
    """
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:2, 3] = rng.uniform(-0.3, 0.3, 2)
    T[:3, :3] = Rotation.from_euler("z", rng.uniform(-np.pi, np.pi)).as_matrix()
    return ScanScene(joined(OBJECTS[thing](), thing), T, _clamp(rng), seed, contrast)


def orbit_poses(
    scene: ScanScene, count: int, *, height: float = 0.5, distance: float = 1.4, arc: float = 360.0
) -> Float64[np.ndarray, "count 4 4"]:
    """T_world_phone of a camera that looks at the thing from `count` places around it.

    Two rounds, one at knee height and one above; the first half of the places is the lower one.

    Args:
        scene: what is filmed.
        count: of poses.
        height: of the point that the camera looks at, over the floor, metres.
        distance: of the camera from that point.
        arc: degrees of the circle that a round goes; less than 360 leaves sides unfilmed.
    """
    target = scene.T_world_object[:3, 3] + [0.0, 0.0, height]
    turns = np.linspace(0.0, 2.0, count, endpoint=False)
    lift = 0.15 + 0.45 * np.clip((turns - 0.9) / 0.2, 0.0, 1.0)
    return np.stack(
        [
            orbit(target, distance, np.radians(arc) * (turn % 1.0 if arc < 360 else turn), up)
            for turn, up in zip(turns, lift, strict=True)
        ]
    )


def intrinsics(width: int) -> Float64[np.ndarray, "4"]:
    """fx, fy, cx, cy of pictures of the phone that are `width` pixels wide and 3/4 as high."""
    focal = _FOCAL * width
    return np.array([focal, focal, (width - 1) / 2, (0.75 * width - 1) / 2])


def film(
    scene: ScanScene, T_world_phone: Iterable[Float64[np.ndarray, "4 4"]], width: int
) -> Iterator[Picture]:
    """Picture and depth at each pose."""
    fx, fy, cx, cy = intrinsics(width).tolist()
    with open_renderer(width, 3 * width // 4) as renderer:
        renderer.show(Scene(scene.drawables, light=ROOM_LIGHT))
        for T in T_world_phone:
            yield renderer.draw(Camera(T, fx, fy, cx, cy))


def _clamp(rng: np.random.Generator) -> Mount:
    """The phone behind the chair's back, looking back and a little up, in any roll."""
    T_object_phone = np.eye(4)
    looking_back = np.stack([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], axis=1)
    crooked = Rotation.from_euler("zxy", [rng.uniform(-np.pi, np.pi), *rng.normal(0, 0.15, 2)])
    T_object_phone[:3, :3] = looking_back @ crooked.as_matrix()
    T_object_phone[:3, 3] = np.array([-0.28, 0.0, 0.8]) + rng.normal(0.0, 0.03, 3).clip(-0.04, 0.06)
    return Mount(inverse(T_object_phone), "truth")
