"""Frames a second at 1280x720 with shadows: ours, stock pyrender, and the ray caster.

A body of 13,718 vertices that moves every frame, a box and a floor, from a following camera. Stock
pyrender has its default flags and shadows, and gets the body as a new mesh every frame, as most scripts
that use it do. All are timed in turns within one run: the machine's load falls on all of them alike.

Usage: python benchmarks/render.py [--frames 12] [--size 1280x720]
"""

import argparse
import sys
import time
from collections.abc import Callable, Generator
from itertools import cycle
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))  # this file has the name of a package

import numpy as np
import torch
import trimesh
from jaxtyping import UInt8

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel, load_body
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion
from render import third_person
from render.cameras import Camera
from render.props import Actor, floor
from render.pyrender_shim import pyrender
from render.renderer import FAR, NEAR

Movie = Generator[UInt8[np.ndarray, "h w 3"]]
TURN = 3
"""Frames of each before the next one's turn."""
GOAL = 6.0
"""Times the frame rate of stock pyrender that ours has at least."""


def glide(body: BodyModel, count: int) -> tuple[HumanMotion, ObjectMotion]:
    """A T-pose gliding along -y behind a box: the cost of a frame does not depend on the pose."""
    upright = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    rotations = np.tile(upright, (count, 22, 1, 1))
    root = np.stack([np.zeros(count), -0.03 * np.arange(count), np.full(count, 0.95)], axis=1)
    joints = forward_kinematics(body, torch.as_tensor(root), torch.as_tensor(rotations)).numpy()
    fingers = np.tile(body.relaxed_fingers.numpy(), (count, 1, 1, 1))
    human = HumanMotion(root, rotations, fingers, joints, np.ones((count, 2)), np.ones((count, 4)))
    box = trimesh.creation.box((0.4, 0.4, 0.4))
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, 3] = root + np.array([0.0, -0.5, 0.2])
    mesh = ObjectMesh(np.array(box.vertices), np.array(box.faces), "box")
    return human, ObjectMotion(mesh, T, np.ones(count, bool))


def stock(
    human: HumanMotion, moved: ObjectMotion, body: BodyModel, width: int, height: int
) -> Movie:
    """pyrender as it comes: 4x multisampling, its own shadows, a new body mesh every frame."""
    cameras = third_person.follow_motion(human, moved, width, height)
    person, thing = third_person.stage(human, moved, body, markers=False)
    scene = pyrender.Scene(bg_color=(0.93, 0.92, 0.91, 1.0), ambient_light=(0.4, 0.4, 0.4))
    used = human.root[:, :2]
    scene.add(
        _mesh(floor(used.min(axis=0), used.max(axis=0)).vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    )
    box = scene.add(_mesh(thing.drawable.vertices, thing.drawable.faces))
    sun = np.eye(4)
    sun[:3, :3] = [[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]]
    scene.add(pyrender.DirectionalLight(intensity=3.0), pose=sun)
    eye = pyrender.IntrinsicsCamera(*_intrinsics(cameras[0]), znear=NEAR, zfar=FAR)
    seen = scene.add(eye, pose=cameras[0].T_world_camera)
    renderer = pyrender.OffscreenRenderer(width, height)
    for frame, camera in enumerate(cameras):
        node = scene.add(_mesh(_posed(person, frame), person.drawable.faces))
        scene.set_pose(box, moved.T_world_object[frame])
        eye.fx, eye.fy, eye.cx, eye.cy = _intrinsics(camera)
        scene.set_pose(seen, camera.T_world_camera)
        color, _ = renderer.render(scene, pyrender.RenderFlags.SHADOWS_DIRECTIONAL)
        scene.remove_node(node)
        yield color


def _intrinsics(camera: Camera) -> tuple[float, float, float, float]:
    return camera.fx, camera.fy, camera.cx, camera.cy


def _posed(person: Actor, frame: int) -> np.ndarray:
    assert person.vertices is not None
    return person.vertices(frame)


def _mesh(vertices: np.ndarray, faces: np.ndarray) -> pyrender.Mesh:
    return pyrender.Mesh.from_trimesh(trimesh.Trimesh(vertices, faces, process=False))


def ours(samples: int, backend: third_person.Backend) -> Callable[..., Movie]:
    """The third-person view as the program draws it."""

    def movie(
        human: HumanMotion, moved: ObjectMotion, body: BodyModel, width: int, height: int
    ) -> Movie:
        return third_person.frames(
            human, moved, body, width=width, height=height, backend=backend, samples=samples
        )

    return movie


def measure(movies: dict[str, Movie], turns: int) -> dict[str, float]:
    """Seconds per frame of each: the median of its turns."""
    for movie in movies.values():  # compiling shaders and painting the floor are not counted
        next(movie)
    taken: dict[str, list[float]] = {name: [] for name in movies}
    order = cycle(movies)
    for _ in range(turns * len(movies)):
        name = next(order)
        start = time.perf_counter()
        for _ in range(TURN):
            next(movies[name])
        taken[name].append((time.perf_counter() - start) / TURN)
    for movie in reversed(movies.values()):  # stock pyrender ends the display, so it goes last
        movie.close()
    return {name: float(np.median(each)) for name, each in taken.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--size", default="1280x720")
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    turns = max(1, options.frames // TURN)
    body = load_body()
    human, moved = glide(body, 1 + turns * TURN)
    kinds = {
        "stock pyrender": stock,
        "ours": ours(0, "pyrender"),
        "ours, smooth edges (4x)": ours(4, "pyrender"),
        "ours, ray caster": ours(0, "raycast"),
    }
    movies = {name: kind(human, moved, body, width, height) for name, kind in kinds.items()}
    seconds = measure(movies, turns)
    for name, each in seconds.items():
        times = seconds["stock pyrender"] / each
        print(f"{name:24} {1000 * each:6.0f} ms  {1 / each:5.1f} fps  {times:4.2f} x stock")
    reached = seconds["stock pyrender"] / seconds["ours"] >= GOAL
    print(f"{width}x{height}: {'at least' if reached else 'LESS THAN'} {GOAL} x stock pyrender")


if __name__ == "__main__":
    main()
