"""Furniture meshes from a folder of wavefront files, as props (an extra: nothing needs them)."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float

from omomo_core.data.synthesis.props.blueprint import Blueprint
from omomo_core.data.synthesis.shapes import Part
from omomo_core.errors import InputError

_SIZES: dict[str, tuple[str, tuple[float, float, float], tuple[float, float, float], float]] = {
    "table_medium_long": ("largetable", (0.65, 1.1, 0.7), (0.95, 1.7, 0.78), 18),
    "table_medium": ("largetable", (0.65, 0.65, 0.68), (1.0, 1.0, 0.78), 14),
    "table_small": ("smalltable", (0.35, 0.35, 0.45), (0.6, 0.6, 0.72), 7),
    "table_low": ("smalltable", (0.45, 0.7, 0.32), (0.65, 1.1, 0.48), 9),
    "chair_stool": ("stool", (0.3, 0.3, 0.36), (0.42, 0.42, 0.7), 4),
    "chair": ("woodchair", (0.4, 0.4, 0.76), (0.52, 0.5, 1.0), 6),
    "armchair": ("armchair", (0.75, 0.75, 0.72), (0.9, 0.95, 0.95), 24),
    "cabinet_small": ("cabinet", (0.35, 0.35, 0.5), (0.55, 0.55, 0.9), 18),
    "cabinet_medium": ("cabinet", (0.4, 0.7, 0.6), (0.5, 1.1, 0.95), 30),
    "lamp_table": ("lamp", (0.25, 0.25, 0.38), (0.36, 0.36, 0.55), 2),
    "cactus": ("plant", (0.25, 0.25, 0.35), (0.45, 0.45, 0.7), 5),
    "pictureframe_standing": ("picture", (0.1, 0.25, 0.25), (0.18, 0.4, 0.4), 1),
    "pictureframe_large": ("picture", (0.05, 0.5, 0.5), (0.1, 0.75, 0.8), 4),
    "pillow": ("pillow", (0.35, 0.4, 0.12), (0.45, 0.55, 0.18), 1),
}
"""What a file whose name starts so is: class, smallest and largest size (depth, width, height), kg."""
_LEGS = 0.5
"""Share of the height of a table or chair that counts as legs."""


@dataclass(frozen=True)
class Furniture:
    """Meshes of a folder (and below it), y up, front toward +z, in any unit.

    Raises:
        InputError: ``furniture-folder`` when the folder holds no mesh of a known kind.
    """

    folder: Path

    def __post_init__(self) -> None:
        if not self._files:
            raise InputError(
                "furniture-folder",
                "There is no .obj file of a known piece of furniture.",
                where=str(self.folder),
                fix=f"Names must start with one of: {', '.join(sorted(_SIZES))}.",
            )

    @cached_property
    def _files(self) -> list[tuple[Path, str]]:
        known = sorted(_SIZES, key=len, reverse=True)
        out: list[tuple[Path, str]] = []
        for path in sorted(self.folder.rglob("*.obj")):
            name = next((n for n in known if path.stem.startswith(n)), None)
            if name is not None and "decorated" not in path.stem:
                out.append((path, name))
        return out

    @cached_property
    def _read(self) -> dict[Path, list[Part]]:
        return {}

    def draw(self, rng: np.random.Generator) -> Blueprint:
        """One of the meshes in a random size of its kind."""
        path, known = self._files[rng.integers(len(self._files))]
        if path not in self._read:
            self._read[path] = _parts(path, known.startswith(("table", "chair")))
        name, smallest, largest, mass = _SIZES[known]
        parts = self._read[path]
        low = np.min([p.low for p in parts], axis=0)
        high = np.max([p.high for p in parts], axis=0)
        scale = rng.uniform(smallest, largest) / (high - low)
        offset = -scale * np.array([*(low + high)[:2] / 2, low[2]])
        sized = [p.moved(np.diag(scale), tuple(offset)) for p in parts]
        return Blueprint(name, sized, mass * rng.uniform(0.7, 1.3))


def _parts(path: Path, on_legs: bool) -> list[Part]:
    """A mesh with z up and its front toward +x; what is low on a table or chair is rarely held."""
    vertices, faces = _read_obj(path)
    middles = vertices[faces][..., 2].mean(axis=1)
    low = on_legs & (middles < _LEGS * vertices[:, 2].max())
    out: list[Part] = []
    for chosen, grip in ((low, 0.1), (~low, 1.0)):
        if chosen.any():
            used, index = np.unique(faces[chosen], return_inverse=True)
            v = vertices[used]
            out.append(Part(v, index.reshape(-1, 3), v.min(axis=0), v.max(axis=0), grip))
    return out


def _read_obj(path: Path) -> tuple[Float[np.ndarray, "v 3"], np.ndarray]:
    """Vertices and triangles; faces with more corners are fanned."""
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            x, y, z = map(float, words[1:4])
            vertices.append([z, x, y])
        elif words[:1] == ["f"]:
            corners = [int(w.split("/")[0]) - 1 for w in words[1:]]
            faces += [[corners[0], b, c] for b, c in pairwise(corners[1:])]
    return np.array(vertices), np.array(faces)
