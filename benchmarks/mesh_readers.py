"""Mesh files of packages read by us and by others: do bounds, area and number of triangles agree?

Usage: python benchmarks/mesh_readers.py FOLDER [FOLDER ...]

Every OBJ, PLY, STL, GLB and glTF below the folders (such as node_modules, site-packages or an unpacked
wheel) is read by us, by trimesh and, where it is installed, by assimp (pip install assimp-py; it is no
part of the product). A file is agreed on when one of the others gives what we give. The others are listed,
with what each reader says; so is what only we refuse. A difference is to be explained by the file: what
trimesh drops, what assimp splits. Equal files are read once.
"""

import hashlib
import logging
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from ingest.mesh_files.file_parts import joined_parts
from ingest.mesh_files.mesh_file import FORMATS, read_mesh_file
from omomo_core.errors import InputError

_SAME = 1e-3
"""Part of the size and of the area by which readers may differ: numbers are rounded and packed."""
_LARGEST = 60 * 10**6


@dataclass(frozen=True)
class Read:
    """What a reader finds in a file, or why it refuses it."""

    triangles: int = 0
    """Those that have an area."""
    low: tuple[float, ...] = ()
    high: tuple[float, ...] = ()
    area: float = 0.0
    refusal: str = ""

    def __str__(self) -> str:
        if self.refusal:
            return f"refused: {self.refusal[:110]}"
        sides = " x ".join(f"{b - a:.4g}" for a, b in zip(self.low, self.high, strict=True))
        return f"{self.triangles:,} triangles, {sides}, area {self.area:.5g}"

    def agrees(self, other: "Read") -> bool:
        """Whether both see the same surface."""
        if self.refusal or other.refusal:
            return bool(self.refusal) == bool(other.refusal)
        size = max(b - a for a, b in zip(self.low, self.high, strict=True)) + 1e-12
        off = np.abs(np.array([*self.low, *self.high]) - [*other.low, *other.high]).max()
        few = abs(self.triangles - other.triangles) <= _SAME * self.triangles
        return bool(few and off < _SAME * size and abs(self.area - other.area) <= _SAME * self.area)


def measured(corners: np.ndarray) -> Read:
    """What triangles, (faces, 3, 3), amount to."""
    if len(corners) == 0:
        return Read(refusal="no triangles")
    double = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    size = float(np.ptp(corners.reshape(-1, 3), axis=0).max())
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    real = int((double > 1e-12 * size**2).sum())
    return Read(real, tuple(low.tolist()), tuple(high.tolist()), float(double.sum() / 2))


def ours(path: Path) -> Read:
    vertices, faces = joined_parts(read_mesh_file(path, 10**8).parts)
    return measured(vertices[faces])


def by_trimesh(path: Path) -> Read:
    scene = trimesh.load_scene(path, process=False, skip_materials=True)
    return measured(np.asarray(scene.to_mesh().triangles))


def by_assimp(path: Path) -> Read:
    import assimp_py  # pyright: ignore[reportMissingImports]

    steps = assimp_py.Process_Triangulate | assimp_py.Process_PreTransformVertices
    found = [
        np.asarray(mesh.vertices, np.float64).reshape(-1, 3)[
            np.asarray(mesh.indices, np.int64).reshape(-1, 3)
        ]
        for mesh in assimp_py.import_file(str(path), steps).meshes
        if mesh.num_indices == 3 * mesh.num_faces
    ]
    return measured(np.concatenate(found) if found else np.empty((0, 3, 3)))


def tried(reader: Callable[[Path], Read], path: Path) -> Read:
    try:
        return reader(path)
    except InputError as error:
        return Read(refusal=error.what)
    except ImportError:
        return Read(refusal="is not installed")
    except BaseException as error:  # readers raise anything, and some in another language
        if isinstance(error, KeyboardInterrupt):
            raise
        return Read(refusal=f"{type(error).__name__}: {error}")


def files(folders: list[Path]) -> Iterator[Path]:
    """Mesh files, equal ones once."""
    seen: set[str] = set()
    for folder in folders:
        for path in sorted(folder.rglob("*")):
            if path.suffix.lower() in FORMATS and path.is_file() and path.stat().st_size < _LARGEST:
                digest = hashlib.sha256(path.read_bytes()).hexdigest()
                if digest not in seen:
                    seen.add(digest)
                    yield path


def main() -> None:
    """Compare all files below the folders that are given."""
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("ignore")
    folders = [Path(word) for word in sys.argv[1:]]
    tally: dict[str, Counter[str]] = {kind: Counter() for kind in FORMATS}
    for path in files(folders):
        began = time.perf_counter()
        mine = tried(ours, path)
        count = tally[path.suffix.lower()]
        count["seconds"] += time.perf_counter() - began  # pyright: ignore[reportArgumentType]
        others = {"trimesh": tried(by_trimesh, path), "assimp": tried(by_assimp, path)}
        count["files"] += 1
        count["refused"] += bool(mine.refusal)
        if any(mine.agrees(other) for other in others.values()):
            count["agreed"] += 1
            continue
        print(f"{path}\n    ours    {mine}")
        for name, other in others.items():
            print(f"    {name:7} {other}")
    print("kind   files  agreed  refused  seconds")
    for kind, count in tally.items():
        print(
            f"{kind:6} {count['files']:5}  {count['agreed']:6}  {count['refused']:7}  {count['seconds']:7.1f}"
        )


if __name__ == "__main__":
    main()
