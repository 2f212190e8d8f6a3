"""A take of the garden chair: what a phone logs that is clamped to its back while it is carried.

Usage: python -m tests.docs.carried_chair chair.glb mount.json take

The picture that the page calibrates the mount with was taken from a metre away, by the phone that filmed the
chair. Nobody can clamp it there, so the mount is replaced by one on the chair's back.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from capture_app.simulator.demo_take import carried_box, write_recording
from capture_app.simulator.simulated_phone import simulate
from ingest.mesh import load_mesh
from ingest.mount_file import load_mount, save_mount
from omomo_core.geometry.transforms import inverse

_OFF = 0.03
"""Metres from the back to the phone's camera, which looks away from it."""


def main() -> None:
    """Write mount and take; the chair stands on its base at both ends."""
    mesh, mount_file, take = (Path(word) for word in sys.argv[1:])
    vertices = np.asarray(load_mesh(mesh).vertices)
    T_object_phone = np.eye(4)
    T_object_phone[:3, :3] = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    T_object_phone[:3, 3] = vertices[vertices[:, 1].argmax()] + [0.0, _OFF, 0.0]
    mount = replace(load_mount(mount_file), T_phone_object=inverse(T_object_phone))
    save_mount(mount, mount_file)
    carried = carried_box()
    T = carried.T_world_object.copy()
    # Its origin is on the floor below its middle, and the box's in its middle.
    T[:, :3, 3] -= T[:, :3, 2] * T[0, 2, 3]
    write_recording(simulate(replace(carried, T_world_object=T), mount, seed=2), take)


if __name__ == "__main__":
    main()
