"""A box whose six sides have a colour each, taken from one picture."""

from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

COLOURS = np.array(
    [[200, 30, 30], [30, 200, 30], [30, 30, 200], [200, 200, 30], [200, 30, 200], [30, 200, 200]],
    np.uint8,
)
"""Of the sides -x, +x, -y, +y, -z, +z, as the file has its axes."""


def write_textured_box(path: Path, extents: tuple[float, float, float] = (0.5, 0.3, 0.2)) -> Path:
    """Write it with its picture: six patches of 8 x 16 pixels, the upper half of each darker."""
    picture = np.repeat(np.repeat(COLOURS[None], 16, axis=0), 8, axis=1)
    picture[:8] //= 2
    vertices, faces, uv = [], [], []
    for side in range(6):
        axis, sign = side // 2, side % 2
        across, up = (axis + 1) % 3, (axis + 2) % 3
        for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
            corner = np.empty(3)
            corner[[axis, across, up]] = sign, a, b
            vertices.append((corner - 0.5) * extents)
            uv.append([(side + 0.05 + 0.9 * a) / 6, 0.05 + 0.9 * b])
        square = np.array([[0, 1, 2], [0, 2, 3]])
        faces.append((square if sign else square[:, ::-1]) + 4 * side)
    material = trimesh.visual.material.SimpleMaterial(
        image=Image.fromarray(picture), diffuse=[255, 255, 255, 255]
    )
    visual = trimesh.visual.TextureVisuals(uv=np.array(uv), material=material)
    mesh = trimesh.Trimesh(np.array(vertices), np.concatenate(faces), visual=visual, process=False)
    mesh.export(path)
    return path
