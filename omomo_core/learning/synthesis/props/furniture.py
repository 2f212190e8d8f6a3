"""Furniture meshes from a folder of wavefront files, as props (an extra: nothing needs them)."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float

from omomo_core.errors import InputError
from omomo_core.learning.synthesis.props.blueprint import Blueprint
from omomo_core.learning.synthesis.shapes import SolidPart

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
        InputError: ``furniture-folder`` when the folder holds no mesh of a known kind;
            ``furniture-mesh`` when one of them cannot be read.
    """

    folder: Path
    classes: frozenset[str] | None = None
    """Only pieces of these classes, if given."""

    def __post_init__(self) -> None:
        if not self.folder.is_dir():
            raise InputError(
                "furniture-folder",
                "The folder of furniture does not exist.",
                where=str(self.folder),
                fix="Give a folder of .obj files.",
            )
        if not self._meshes:
            raise InputError(
                "furniture-folder",
                "There is no .obj file of a known piece of furniture"
                + (" of the objects asked for." if self.classes else "."),
                where=str(self.folder),
                fix=f"Names must start with one of: {', '.join(sorted(self._kinds))}.",
            )

    @property
    def digest(self) -> str:
        """The same for the same files of known kinds in any folder."""
        seen = hashlib.sha256()
        for path, _ in self._files:
            seen.update(path.relative_to(self.folder).as_posix().encode() + b"\0")
            seen.update(hashlib.sha256(path.read_bytes()).digest())
        return seen.hexdigest()[:16]

    @property
    def _kinds(self) -> list[str]:
        return [k for k, size in _SIZES.items() if self.classes is None or size[0] in self.classes]

    @cached_property
    def _files(self) -> list[tuple[Path, str]]:
        known, wanted = sorted(_SIZES, key=len, reverse=True), self._kinds
        out: list[tuple[Path, str]] = []
        for path in sorted(self.folder.rglob("*.obj")):
            name = next((n for n in known if path.stem.startswith(n)), None)
            if name in wanted and "decorated" not in path.stem:
                out.append((path, name))
        return out

    @cached_property
    def _meshes(self) -> list[tuple[str, list[SolidPart]]]:
        """Kind and parts of each; read once, for every worker process."""
        return [
            (kind, _parts(path, kind.startswith(("table", "chair")))) for path, kind in self._files
        ]

    def draw(self, rng: np.random.Generator) -> Blueprint:
        """One of the meshes in a random size of its kind."""
        kind, parts = self._meshes[rng.integers(len(self._meshes))]
        name, smallest, largest, mass = _SIZES[kind]
        low = np.min([p.low for p in parts], axis=0)
        high = np.max([p.high for p in parts], axis=0)
        scale = rng.uniform(smallest, largest) / (high - low)
        offset = -scale * np.array([*(low + high)[:2] / 2, low[2]])
        sized = [p.moved(np.diag(scale), tuple(offset)) for p in parts]
        return Blueprint(name, sized, mass * rng.uniform(0.7, 1.3))


def _parts(path: Path, on_legs: bool) -> list[SolidPart]:
    """A mesh with z up and its front toward +x; what is low on a table or chair is rarely held."""
    vertices, faces = _read_obj(path)
    middles = vertices[faces][..., 2].mean(axis=1)
    low = on_legs & (middles < _LEGS * vertices[:, 2].max())
    out: list[SolidPart] = []
    for chosen, grip in ((low, 0.1), (~low, 1.0)):
        if chosen.any():
            used, index = np.unique(faces[chosen], return_inverse=True)
            v = vertices[used]
            out.append(SolidPart(v, index.reshape(-1, 3), v.min(axis=0), v.max(axis=0), grip))
    return out


def _read_obj(path: Path) -> tuple[Float[np.ndarray, "v 3"], np.ndarray]:
    """Vertices and triangles.

    Raises:
        InputError: ``furniture-mesh`` when the file holds no solid surface.
    """
    try:
        vertices, faces = _surface(path.read_text(encoding="utf-8"))
        finite = np.isfinite(vertices).all()
        # What is flat has no size to be changed.
        if not (finite and (np.ptp(vertices[faces].reshape(-1, 3), axis=0) > 0).all()):
            raise ValueError("no extent")
    except (OSError, ValueError, IndexError) as error:
        raise InputError(
            "furniture-mesh",
            "This piece of furniture cannot be used: its surface is missing, flat or damaged.",
            where=str(path),
            fix="Export it as .obj again, or take it out of the folder.",
        ) from error
    return vertices, faces


def _surface(text: str) -> tuple[np.ndarray, np.ndarray]:
    """What a wavefront file says; faces with more than three corners are fanned."""
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for line in text.splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            x, y, z = map(float, words[1:4])
            vertices.append([z, x, y])
        elif words[:1] == ["f"]:
            corners = [_corner(word, len(vertices)) for word in words[1:]]
            faces += [[corners[0], b, c] for b, c in pairwise(corners[1:])]
    return np.array(vertices), np.array(faces)


def _corner(word: str, count: int) -> int:
    """Index of a vertex, which files count from 1, or from -1 back from the last one read."""
    number = int(word.split("/")[0])
    if number == 0 or number < -count:
        raise ValueError("no such vertex")
    return number - 1 if number > 0 else count + number
