"""read_obj: the polygons of a Wavefront OBJ file, with colours of vertices and pictures of materials.

Statements end with their line, or go on after a backslash; any white space separates; # begins a comment.
Faces name corners as place, place/texture, place//normal or place/texture/normal; negative numbers
count back from what stands before the face. Parts are what one object has in one material.
"""

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64, UInt8

from ingest.mesh_files.file_parts import (
    FilePart,
    ReadMesh,
    constant_colour,
    cut_short,
    only_used,
    too_large,
)
from ingest.mesh_files.mtl_file import Material, read_materials
from ingest.mesh_files.polygons import triangulated
from omomo_core.errors import DamageError

_NUMBERS = {b"v": 3, b"vt": 1, b"f": 3, b"fo": 3}
"""Fewest words after these keywords."""
_NO_SURFACE = {b"l": "lines", b"p": "points", b"curv": "curves", b"surf": "free-form surfaces"}
_MOST_PARTS = 2000
"""More objects are one."""


@dataclass
class _Run:
    """Faces that stand together: of one object, in one material."""

    name: str
    material: str
    counts: array = field(default_factory=lambda: array("q"))
    places: array = field(default_factory=lambda: array("q"))
    textures: array = field(default_factory=lambda: array("q"))
    """Numbers from 0, one a corner; -1 for a corner without a texture coordinate."""


@dataclass
class _Statements:
    """What the file says, in its order."""

    vertices: list[list[float]] = field(default_factory=list[list[float]])
    textures: list[tuple[float, float]] = field(default_factory=list[tuple[float, float]])
    runs: dict[tuple[str, str], _Run] = field(default_factory=dict[tuple[str, str], _Run])
    libraries: list[str] = field(default_factory=list[str])
    left_out: set[str] = field(default_factory=set[str])
    short: bool = False
    """Whether a face has fewer than three corners."""


def read_obj(path: Path, most: int) -> ReadMesh:
    """Read a file with the material libraries that lie beside it.

    Args:
        path: the file.
        most: triangles that are read.

    Raises:
        InputError: "mesh-too-large", or "mesh-truncated" where its last statement surely lacks its end.
        ValueError: the file is damaged.
    """
    data = path.read_bytes()
    if b"\0" in data[:4096]:
        raise DamageError("it is no text")
    said = _read(data, path)
    triangles = sum(sum(run.counts) - 2 * len(run.counts) for run in said.runs.values())
    if triangles > most:
        raise too_large(path, f"{triangles:,} triangles")
    vertices, colours = _split(said.vertices)
    textures = np.array(said.textures, np.float64).reshape(-1, 2)
    materials, lost = read_materials(path, said.libraries)
    parts = [
        _part(run, vertices, colours, textures, materials.get(run.material))
        for run in said.runs.values()
        if run.counts
    ]
    end = _end_notes(data, said, sum(len(part.vertices) for part in parts), path)
    left = sorted(said.left_out) + (["faces of fewer than three corners"] if said.short else [])
    notes = (*end, f"{', '.join(left)} left out") if left else end
    textured = any(run.textures and max(run.textures) >= 0 for run in said.runs.values())
    return ReadMesh(tuple(parts), (*notes, *(lost if textured else ())))


def _lines(data: bytes) -> Iterator[list[bytes]]:
    """The words of each statement."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\\" in data:
        data = data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")
    if b"\r" in data and b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    for line in data.split(b"\n"):
        words = line.partition(b"#")[0].split()
        if words:
            yield words


def _read(data: bytes, path: Path) -> _Statements:
    said, name, material = _Statements(), path.stem, ""
    run = said.runs.setdefault((name, material), _Run(name, material))
    last: list[bytes] = []
    for words in _lines(data):
        key, last = words[0], words
        if key == b"v":
            said.vertices.append(_numbers(words[1:9]))
        elif key in (b"f", b"fo"):
            _face(words, run, said)
        elif key == b"vt":
            said.textures.append((float(words[1]), float(words[2]) if len(words) > 2 else 0.0))
        elif key in (b"usemtl", b"o"):
            text = b" ".join(words[1:]).decode("utf-8", "replace")
            name, material = (text or name, material) if key == b"o" else (name, text)
            name = name if len(said.runs) < _MOST_PARTS else run.name
            run = said.runs.setdefault((name, material), _Run(name, material))
        elif key == b"mtllib":
            said.libraries.append(b" ".join(words[1:]).decode("utf-8", "replace"))
        elif key in _NO_SURFACE:
            said.left_out.add(_NO_SURFACE[key])
    whole = not last or data.endswith((b"\n", b"\r"))
    if not whole and len(last) <= _NUMBERS.get(last[0], 0):
        raise cut_short(
            path, f"its last line is {b' '.join(last)[:40].decode('utf-8', 'replace')!r}"
        )
    return said


def _numbers(words: list[bytes]) -> list[float]:
    try:
        return [float(word) for word in words]
    except ValueError:
        bad = b" ".join(words)[:40].decode("utf-8", "replace")
        raise DamageError(f"{bad!r} are no numbers of a vertex") from None


def _face(words: list[bytes], run: _Run, said: _Statements) -> None:
    if len(words) < 4:
        said.short = True
        return
    places, textures = len(said.vertices), len(said.textures)
    for word in words[1:]:
        place, slash, rest = word.partition(b"/")
        number = int(place)
        run.places.append(number - 1 if number > 0 else places + number if number else -1)
        texture = rest.partition(b"/")[0] if slash else b""
        number = int(texture) if texture else 0
        run.textures.append(number - 1 if number > 0 else textures + number if number else -1)
    run.counts.append(len(words) - 1)


def _split(
    rows: list[list[float]],
) -> tuple[Float64[np.ndarray, "verts 3"], UInt8[np.ndarray, "verts 3"] | None]:
    """Positions and colours (0 to 1, or 0 to 255) of lines of 3, 4 (a weight), 6 or 7 numbers."""
    if any(len(row) < 3 for row in rows):
        raise DamageError("a vertex has fewer than three numbers")
    vertices = np.array([row[:3] for row in rows], np.float64).reshape(-1, 3)
    if not rows or min(map(len, rows)) < 6:
        return vertices, None
    colours = np.array([row[3:6] for row in rows], np.float64)
    colours = np.nan_to_num(colours) * (1.0 if colours.max(initial=0.0) > 1.0 else 255.0)
    return vertices, np.rint(colours.clip(0, 255)).astype(np.uint8)


def _part(
    run: _Run,
    vertices: Float64[np.ndarray, "verts 3"],
    colours: UInt8[np.ndarray, "verts 3"] | None,
    textures: Float64[np.ndarray, "textures 2"],
    material: Material | None,
) -> FilePart:
    places = np.array(run.places, np.int64)
    corners = triangulated(vertices, places, np.array(run.counts, np.int64))
    used, faces = only_used(vertices, places[corners])
    own = None if colours is None else colours[used]
    name = f"{run.name}/{run.material}" if run.material else run.name
    uv = None if material is None else _places(run, corners, textures, material)
    if uv is not None and material is not None:
        return FilePart(name, vertices[used], faces, None, uv, material.picture)
    if own is None and material is not None and material.colour is not None:
        own = constant_colour(material.colour, len(used))
    return FilePart(name, vertices[used], faces, own)


def _places(
    run: _Run,
    corners: Int64[np.ndarray, "faces 3"],
    textures: Float64[np.ndarray, "textures 2"],
    material: Material,
) -> Float64[np.ndarray, "faces 3 2"] | None:
    """Places on the material's picture; None without a picture, or where a corner has none."""
    numbers = np.array(run.textures, np.int64)[corners]
    if material.picture is None or not len(numbers) or numbers.min() < 0:
        return None
    if numbers.max() >= len(textures):
        return None
    # OBJ counts from the bottom left.
    uv = textures[numbers] * material.scale + material.offset
    return uv * [1.0, -1.0] + [0.0, 1.0]


def _end_notes(data: bytes, said: _Statements, used: int, path: Path) -> tuple[str, ...]:
    """What is to be told of a file that ends amid a line, as some programs write them.

    Raises:
        InputError: "mesh-truncated" where a face lacks the end of its last number, or vertices their faces.
    """
    if data.endswith((b"\n", b"\r")) or not used:
        return ()
    words = data[data.rfind(b"\n") + 1 :].partition(b"#")[0].split()
    if not words or words[0] not in (b"f", b"fo"):
        return ()
    if used < len(said.vertices):
        missing = len(said.vertices) - used
        raise cut_short(path, f"it ends within its faces, and {missing:,} vertices have none yet")
    edges = _edges(said)
    if _lacks_digits(words, edges, len(said.vertices)):
        raise cut_short(path, f"its last number, {words[-1].decode()}, lacks digits")
    if all((b, a) in edges for a, b in edges):
        return ()
    return ("no line end at its end, and an open surface: if a piece is missing, it was cut short",)


def _edges(said: _Statements) -> set[tuple[int, int]]:
    """Edges of all polygons, in their direction."""
    found: set[tuple[int, int]] = set()
    for run in said.runs.values():
        places, counts = np.array(run.places, np.int64), np.array(run.counts, np.int64)
        after = np.arange(1, len(places) + 1)
        ends = np.cumsum(counts)
        after[ends - 1] = ends - counts
        found.update(zip(places.tolist(), places[after].tolist(), strict=True))
    return found


def _lacks_digits(words: list[bytes], edges: set[tuple[int, int]], vertices: int) -> bool:
    """Whether the last face meets more neighbours if its last number has one digit more."""
    if not words[-1].isdigit() or not all(word.partition(b"/")[0].isdigit() for word in words[1:]):
        return False
    last, *others = [int(word.partition(b"/")[0]) - 1 for word in reversed(words[1:])]
    first, before = others[-1], others[0]

    def neighbours(corner: int) -> int:
        return ((corner, before) in edges) + ((first, corner) in edges)

    more = range(10 * (last + 1) - 1, min(10 * (last + 1) + 9, vertices))
    return any(neighbours(corner) > neighbours(last) for corner in more)
