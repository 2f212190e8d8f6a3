"""Things to scan, each standing on z = 0 at the origin of its own frame, metres."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from render.scene import Drawable
from tests.simulator.scan_shapes import box, rod, turned

_CHAIR = {
    "seat": [[-0.22, -0.22, 0.41], [0.22, 0.22, 0.46]],
    "back": [[-0.24, -0.20, 0.46], [-0.20, 0.20, 0.95]],
    "leg 1": [[-0.21, -0.21, 0.0], [-0.16, -0.16, 0.41]],
    "leg 2": [[-0.21, 0.16, 0.0], [-0.16, 0.21, 0.41]],
    "leg 3": [[0.16, -0.21, 0.0], [0.21, -0.16, 0.41]],
    "leg 4": [[0.16, 0.16, 0.0], [0.21, 0.21, 0.41]],
    "arm": [[-0.20, 0.18, 0.60], [0.15, 0.22, 0.64]],
}
"""Lowest and highest corner of each part."""


def chair() -> list[Drawable]:
    """With four legs, a back, and one arm, so that it has no symmetry."""
    return [box(name, np.array(corners)) for name, corners in _CHAIR.items()]


def carton() -> list[Drawable]:
    """A moving box with a smaller parcel that is glued to its top."""
    return [
        box("carton", np.array([[-0.25, -0.18, 0.0], [0.25, 0.18, 0.32]])),
        box("parcel", np.array([[-0.20, -0.10, 0.32], [-0.02, 0.12, 0.41]])),
    ]


def bin_() -> list[Drawable]:
    """An open round bin with a wall of 8 mm and a box at its side, as a pedal has."""
    wall = 0.008
    outline = [(0.0, 0.0), (0.15, 0.0), (0.19, 0.45), (0.19 - wall, 0.45)]
    inside = [(0.15 - wall, wall), (0.0, wall)]
    return [
        turned("bin", [*outline, *inside]),
        box("pedal", np.array([[0.14, -0.05, 0.0], [0.22, 0.05, 0.05]])),
    ]


def floor_lamp() -> list[Drawable]:
    """A round foot, a pole of 3 cm, and a shade that is open above and below."""
    shade = [(0.15, 1.10), (0.10, 1.35), (0.097, 1.35), (0.147, 1.10), (0.15, 1.10)]
    return [
        turned("foot", [(0.0, 0.0), (0.15, 0.0), (0.15, 0.025), (0.0, 0.025)]),
        rod("pole", 0.015, 0.025, 1.22),
        turned("shade", shade),
        box("spoke", np.array([[-0.125, -0.006, 1.21], [0.125, 0.006, 1.222]])),
    ]


def mop() -> list[Drawable]:
    """A flat head on the floor with a leaning pole of 2.4 cm."""
    lean = Rotation.from_euler("y", 0.12).as_matrix()
    pole = rod("pole", 0.012, 0.0, 1.25)
    return [
        box("head", np.array([[-0.06, -0.20, 0.0], [0.06, 0.20, 0.035]])),
        box("joint", np.array([[-0.025, -0.03, 0.035], [0.025, 0.03, 0.075]])),
        replace(pole, vertices=pole.vertices @ lean.T + [0.0, 0.0, 0.06]),
    ]


OBJECTS: Mapping[str, Callable[[], Sequence[Drawable]]] = {
    "chair": chair,
    "box": carton,
    "bin": bin_,
    "floor lamp": floor_lamp,
    "mop": mop,
}
"""By name, those that are easy first."""
