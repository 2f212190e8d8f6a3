"""A chair in a room, filmed all around by a phone that is then clamped to it: all poses known."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from ingest.mount.mount import Mount
from omomo_core.geometry.transforms import inverse
from omomo_core.motion import ObjectMesh
from render.cameras import Camera, orbit
from render.renderer import Picture, open_renderer
from render.room import ROOM_LIGHT, busy_texture, room
from render.scene import Drawable, Scene

ROOM = np.array([[-2.6, -2.3, 0.0], [2.4, 2.5, 2.7]])
"""Its lowest and highest corner, metres."""
_PARTS = {
    "seat": [[-0.22, -0.22, 0.41], [0.22, 0.22, 0.46]],
    "back": [[-0.24, -0.20, 0.46], [-0.20, 0.20, 0.95]],
    "leg 1": [[-0.21, -0.21, 0.0], [-0.16, -0.16, 0.41]],
    "leg 2": [[-0.21, 0.16, 0.0], [-0.16, 0.21, 0.41]],
    "leg 3": [[0.16, -0.21, 0.0], [0.21, -0.16, 0.41]],
    "leg 4": [[0.16, 0.16, 0.0], [0.21, 0.21, 0.41]],
    "arm": [[-0.20, 0.18, 0.60], [0.15, 0.22, 0.64]],
}
"""Lowest and highest corner of each, metres; the origin is on the floor below the seat's middle."""
_FOCAL = 1460 / 1920
"""In widths of the picture."""


@dataclass(frozen=True)
class ScanScene:
    """What there is to film, in a world with z up and the floor at 0."""

    mesh: ObjectMesh
    """The chair, in its own frame."""
    T_world_object: Float64[np.ndarray, "4 4"]
    mount: Mount
    """Where the chair is to the phone once it is clamped: what a calibration is to find."""
    seed: int
    """Of what everything is painted with."""

    @cached_property
    def drawables(self) -> tuple[Drawable, ...]:
        """The room and the chair in it."""
        R, t = self.T_world_object[:3, :3], self.T_world_object[:3, 3]
        rng = np.random.default_rng(self.seed)
        chair = [_box(name, np.array(corners)) for name, corners in _PARTS.items()]
        painted = [
            replace(part, vertices=part.vertices @ R.T + t, texture=busy_texture(rng, 512))
            for part in chair
        ]
        return (*room(ROOM[0], ROOM[1], self.seed), *painted)

    @property
    def T_world_clamped(self) -> Float64[np.ndarray, "4 4"]:
        """The clamped phone's camera."""
        return self.T_world_object @ inverse(self.mount.T_phone_object)


def scan_scene(seed: int) -> ScanScene:
    """A chair somewhere in a room, and a phone on the back of its back, looking away from it.

    Args:
        seed: of the chair's place, of the clamp, and of what everything is painted with.
    """
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:2, 3] = rng.uniform(-0.3, 0.3, 2)
    T[:3, :3] = Rotation.from_euler("z", rng.uniform(-np.pi, np.pi)).as_matrix()
    parts = [_box(name, np.array(corners)) for name, corners in _PARTS.items()]
    return ScanScene(_joined(parts), T, _clamp(rng), seed)


def orbit_poses(scene: ScanScene, count: int) -> Float64[np.ndarray, "count 4 4"]:
    """T_world_phone of a camera that looks at the chair from `count` places around it.

    Two rounds, one at knee height and one above; the first half of the places is the lower one.
    """
    target = scene.T_world_object[:3, 3] + [0.0, 0.0, 0.5]
    turns = np.linspace(0.0, 2.0, count, endpoint=False)
    lift = 0.15 + 0.45 * np.clip((turns - 0.9) / 0.2, 0.0, 1.0)
    return np.stack(
        [orbit(target, 1.4, 2 * np.pi * turn, up) for turn, up in zip(turns, lift, strict=True)]
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


def _box(name: str, corners: Float64[np.ndarray, "2 3"]) -> Drawable:
    """A box whose six sides show six parts of a texture."""
    vertices, faces, uv = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    for axis in range(3):
        for side in range(2):
            quad = np.empty((4, 3))
            quad[:, axis] = corners[side, axis]
            for k, across in enumerate(((axis + 1) % 3, (axis + 2) % 3)):
                quad[:, across] = corners[0, across] + square[:, k] * np.ptp(corners[:, across])
            outward = [[0, 1, 2], [0, 2, 3]] if side else [[0, 2, 1], [0, 3, 2]]
            faces.append(np.array(outward) + 4 * len(vertices))
            vertices.append(quad)
            uv.append((square + np.array([axis, side])) / [3, 2])
    joined = np.concatenate
    return Drawable(name, joined(vertices), joined(faces), uv=joined(uv))


def _joined(parts: Sequence[Drawable]) -> ObjectMesh:
    first = np.cumsum([0, *(len(p.vertices) for p in parts[:-1])])
    return ObjectMesh(
        np.concatenate([p.vertices for p in parts]),
        np.concatenate([p.faces + at for p, at in zip(parts, first, strict=True)]),
        "chair",
    )
