"""Milliseconds per frame of both backends, third-person view with body, box, floor and shadows.

Usage: python benchmarks/render_speed.py [frames]
"""

import sys
import time

import numpy as np
import torch
import trimesh

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.load import load_body
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion
from render import third_person
from render.renderer import Backend

CASES: tuple[tuple[Backend, int], ...] = (("pyrender", 4), ("pyrender", 0), ("raycast", 0))
SIZES = ((640, 360), (960, 540), (1280, 720))


def walk(count: int) -> tuple[HumanMotion, ObjectMotion]:
    """A T-pose gliding along -y behind a box: the cost of a frame does not depend on the pose."""
    body = load_body()
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


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 40
    human, box = walk(count)
    body = load_body()
    for backend, samples in CASES:
        for width, height in SIZES:
            movie = third_person.frames(
                human, box, body, width=width, height=height, backend=backend, samples=samples
            )
            next(movie)  # compiling shaders and painting the floor are not counted
            start = time.perf_counter()
            drawn = sum(1 for _ in movie)
            each = 1000 * (time.perf_counter() - start) / drawn
            name = f"{backend} {samples}x" if backend == "pyrender" else backend
            print(f"{name:12} {width:4}x{height:<4} {each:6.0f} ms/frame {1000 / each:5.1f} fps")


if __name__ == "__main__":
    main()
