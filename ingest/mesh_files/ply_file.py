"""read_ply: the polygons and strips of a PLY file, text or binary of either byte order."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float64, Int64, UInt8

from ingest.mesh_files.file_parts import FilePart, ReadMesh, cut_short, only_used, too_large
from ingest.mesh_files.mtl_file import picture_inside
from ingest.mesh_files.polygons import triangulated
from ingest.mesh_texture import BaseColour
from omomo_core.errors import DamageError

_HEAD = 65536
"""Bytes within which the header ends."""
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8", "int64": "i8", "uint64": "u8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str
    """numpy's name of its type, without the byte order."""
    count: str | None
    """The same of the number before a list; None for a single value."""


@dataclass(frozen=True)
class _Element:
    name: str
    rows: int
    properties: tuple[_Property, ...]

    @property
    def least(self) -> int:
        """Bytes of its rows if all lists are empty."""
        kinds = (p.count or p.kind for p in self.properties)
        return self.rows * sum(np.dtype(kind).itemsize for kind in kinds)


_RGB = ("red", "green", "blue")
_Column = tuple[np.ndarray, Int64[np.ndarray, " rows"] | None]
"""Values of a property, and how many each row has; None for one."""
_Table = dict[str, _Column]


def read_ply(path: Path, most: int) -> ReadMesh:
    """Read a file, whatever elements it has besides.

    Args:
        path: the file.
        most: triangles that are read.

    Raises:
        InputError: "mesh-too-large"; "mesh-truncated" where fewer rows follow than its header says.
        ValueError: the file is damaged.
    """
    data = path.read_bytes()
    order, elements, pictures, start = _header(data)
    tables = (
        _text(data[start:], elements, path)
        if not order
        else _binary(data, start, elements, order, path)
    )
    vertices, colours = _vertices(tables.get("vertex", {}))
    strips = _strips(tables)
    faces = tables.get("face", {})
    counts, corners = _lists(faces, "vertex_indices", "vertex_index")
    if faces and not len(counts) and any(len(values) for values, _ in faces.values()):
        raise DamageError(f"its faces have no list vertex_indices, but {', '.join(faces)[:60]}")
    triangles = int(np.maximum(counts - 2, 0).sum()) + len(strips)
    if triangles > most:
        raise too_large(path, f"{triangles:,} triangles")
    used = triangulated(vertices, corners, counts)
    of_face = np.repeat(np.arange(len(counts)), np.maximum(counts - 2, 0))
    uv = _places(faces, tables.get("vertex", {}), corners, counts, used, len(strips))
    all_faces = np.concatenate([corners[used].reshape(-1, 3), strips])
    if colours is None and "red" in faces and not len(strips):
        colours = _of_faces(faces, all_faces, of_face, len(vertices))
    surface = _Surface(vertices, all_faces, colours, uv)
    number = _shown(faces, of_face, len(pictures))
    unrolled = ("triangle strips unrolled",) if len(strips) else ()
    if not pictures or uv is None or number is None:
        unsaid = "which one they show" if uv is not None else "where on them they lie"
        lost = (f"its pictures left out: its faces do not say {unsaid}",) if pictures else ()
        return ReadMesh((surface.part(path.stem, None, None),), (*unrolled, *lost))
    looks = [picture_inside(path.parent, name) for name in pictures]
    used = np.unique(number).tolist()
    parts = [surface.part(f"{path.stem} {k}", number == k, looks[k]) for k in used]
    lost = tuple(
        f"its picture {pictures[k][:60]} left out: it is not beside it, or damaged"
        for k in used
        if looks[k] is None
    )
    return ReadMesh(tuple(parts), (*unrolled, *lost))


@dataclass(frozen=True)
class _Surface:
    """All that is drawn of a file."""

    vertices: Float64[np.ndarray, "verts 3"]
    faces: Int64[np.ndarray, "faces 3"]
    colours: UInt8[np.ndarray, "verts 3"] | None
    uv: Float64[np.ndarray, "faces 3 2"] | None

    def part(
        self, name: str, which: Bool[np.ndarray, " faces"] | None, picture: BaseColour | None
    ) -> FilePart:
        """Those triangles that show a picture; None for all."""
        chosen = slice(None) if which is None else which
        own, renumbered = only_used(self.vertices, self.faces[chosen])
        colours = None if self.colours is None or picture else self.colours[own]
        places = self.uv[chosen] if picture and self.uv is not None else None
        return FilePart(name, self.vertices[own], renumbered, colours, places, picture)


def _shown(
    faces: _Table, of_face: Int64[np.ndarray, " faces"], pictures: int
) -> Int64[np.ndarray, " faces"] | None:
    """The number of the picture that each triangle shows; None where that is not said of several."""
    if pictures <= 1:
        return np.zeros(len(of_face), np.int64)
    values, counts = faces.get("texnumber", (None, None))
    if values is None or counts is not None:
        return None
    number = values.astype(np.int64)[of_face]
    return number if ((number >= 0) & (number < pictures)).all() else None


def _header(data: bytes) -> tuple[str, list[_Element], list[str], int]:
    """Byte order ("" of text), elements, names of pictures, and where the rows begin."""
    end = re.search(rb"(?:^|[\r\n])end_header[ \t]*(\r\n|\n|\r)", data[:_HEAD])
    if not data.startswith(b"ply") or end is None:
        raise DamageError("it has no header of a PLY file")
    order, elements, pictures = None, list[_Element](), list[str]()
    for line in data[: end.start()].decode("latin-1").splitlines():
        words = line.split()
        match words:
            case ["format", kind, *_] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", name, count, *_] if count.isdigit():
                elements.append(_Element(name, int(count), ()))
            case ["property", *told] if elements:
                last = elements[-1]
                elements[-1] = _Element(last.name, last.rows, (*last.properties, _property(told)))
            case ["comment", "TextureFile", *name]:
                pictures.append(" ".join(name))
            case ["property" | "element" | "format", *_]:
                raise DamageError(f"its header has the line {line[:60]!r}")
            case _:
                pass
    if order is None:
        raise DamageError("its header names no format")
    return order, elements, pictures, end.end()


def _property(told: list[str]) -> _Property:
    match told:
        case ["list", count, kind, name] if count in _TYPES and kind in _TYPES:
            return _Property(name, _TYPES[kind], _TYPES[count])
        case [kind, name] if kind in _TYPES:
            return _Property(name, _TYPES[kind], None)
        case _:
            raise DamageError(f"its header has the property {' '.join(told)[:60]!r}")


def _binary(
    data: bytes, start: int, elements: Sequence[_Element], order: str, path: Path
) -> dict[str, _Table]:
    tables: dict[str, _Table] = {}
    for element in elements:
        if element.least > len(data) - start:
            raise _lacking(element, path)
        table, start = _binary_rows(data, start, element, order, path)
        tables.setdefault(element.name, table)
    return tables


def _lacking(element: _Element, path: Path) -> Exception:
    return cut_short(
        path, f"its {element.rows:,} rows of {element.name!r} do not fit into what is there"
    )


def _binary_rows(
    data: bytes, start: int, element: _Element, order: str, path: Path
) -> tuple[_Table, int]:
    """The rows of an element, and where the next begins; rows of equal lists are read at once."""
    if element.rows == 0:
        return {p.name: _empty(p) for p in element.properties}, start
    lengths = _first_lengths(data, start, element, order)
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = []
    for k, p in enumerate(element.properties):
        if p.count is None:
            fields.append((f"v{k}", order + p.kind))
        else:
            fields += [(f"n{k}", order + p.count), (f"v{k}", order + p.kind, (lengths[k],))]
    row = np.dtype(fields)
    if row.itemsize * element.rows <= len(data) - start:
        rows = np.frombuffer(data, row, element.rows, start)
        lists = [k for k, p in enumerate(element.properties) if p.count is not None]
        if all((rows[f"n{k}"] == lengths[k]).all() for k in lists):
            return _columns(rows, element, lengths), start + row.itemsize * element.rows
    return _uneven_rows(data, start, element, order, path)


def _empty(p: _Property) -> _Column:
    return np.empty(0, p.kind), None if p.count is None else np.empty(0, np.int64)


def _first_lengths(data: bytes, start: int, element: _Element, order: str) -> dict[int, int]:
    """How long the lists of the first row are."""
    lengths: dict[int, int] = {}
    for k, p in enumerate(element.properties):
        number = np.dtype(order + (p.count or p.kind))
        size = np.dtype(p.kind).itemsize
        if p.count is not None:
            if start + number.itemsize > len(data):
                lengths[k] = 0
                continue
            lengths[k] = int(np.frombuffer(data, number, 1, start)[0])
            if not 0 <= lengths[k] * size <= len(data):
                raise DamageError("a list has an impossible length")
            start += number.itemsize + lengths[k] * size
        else:
            start += size
    return lengths


def _columns(rows: np.ndarray, element: _Element, lengths: dict[int, int]) -> _Table:
    return {
        p.name: (
            rows[f"v{k}"].reshape(-1),
            None if p.count is None else np.full(len(rows), lengths[k], np.int64),
        )
        for k, p in enumerate(element.properties)
    }


def _uneven_rows(
    data: bytes, start: int, element: _Element, order: str, path: Path
) -> tuple[_Table, int]:
    """Rows whose lists differ in length, one after the other."""
    kinds = [
        (np.dtype(order + p.kind), None if p.count is None else np.dtype(order + p.count))
        for p in element.properties
    ]
    pieces: list[list[bytes]] = [[] for _ in kinds]
    counts: list[list[int]] = [[] for _ in kinds]
    byteorder = "big" if order == ">" else "little"
    for _ in range(element.rows):
        for k, (kind, counted) in enumerate(kinds):
            length = 1
            if counted is not None:
                length = int.from_bytes(
                    data[start : start + counted.itemsize], byteorder, signed=counted.kind == "i"
                )
                start += counted.itemsize
                counts[k].append(length)
            stop = start + length * kind.itemsize
            if length < 0:
                raise DamageError("a list has an impossible length")
            if stop > len(data):
                raise _lacking(element, path)
            pieces[k].append(data[start:stop])
            start = stop
    table: _Table = {
        p.name: (
            np.frombuffer(b"".join(pieces[k]), kinds[k][0]),
            None if p.count is None else np.array(counts[k], np.int64),
        )
        for k, p in enumerate(element.properties)
    }
    return table, start


def _text(data: bytes, elements: Sequence[_Element], path: Path) -> dict[str, _Table]:
    lines = [line for line in data.replace(b"\r", b"\n").split(b"\n") if line.strip()]
    wanted = sum(element.rows for element in elements)
    if len(lines) < wanted:
        raise cut_short(path, f"{len(lines)} lines follow its header instead of {wanted}")
    tables: dict[str, _Table] = {}
    at = 0
    for element in elements:
        tables.setdefault(element.name, _text_rows(lines[at : at + element.rows], element))
        at += element.rows
    return tables


def _text_rows(lines: list[bytes], element: _Element) -> _Table:
    values: list[list[float]] = [[] for _ in element.properties]
    counts: list[list[int]] = [[] for _ in element.properties]
    for line in lines:
        words = line.split()
        at = 0
        for k, p in enumerate(element.properties):
            length = 1
            if p.count is not None:
                length = int(words[at])
                at += 1
                counts[k].append(length)
            if length < 0 or at + length > len(words):
                raise DamageError(f"a row of {element.name!r} has too few numbers: {line[:60]!r}")
            values[k].extend(map(float, words[at : at + length]))
            at += length
    with np.errstate(invalid="ignore"):  # a number that its type cannot hold
        return {
            p.name: (
                np.array(values[k], np.float64).astype(p.kind),
                None if p.count is None else np.array(counts[k], np.int64),
            )
            for k, p in enumerate(element.properties)
        }


def _vertices(
    table: _Table,
) -> tuple[Float64[np.ndarray, "verts 3"], UInt8[np.ndarray, "verts 3"] | None]:
    if not {"x", "y", "z"} <= table.keys():
        raise DamageError("it has no vertices with x, y and z")
    vertices = np.stack([table[axis][0].astype(np.float64) for axis in "xyz"], axis=1)
    return vertices, _colours(table)


def _colours(table: _Table) -> UInt8[np.ndarray, "rows 3"] | None:
    """Bytes of sRGB of an element's rows."""
    for names in (
        ("red", "green", "blue"),
        ("diffuse_red", "diffuse_green", "diffuse_blue"),
        ("r", "g", "b"),
    ):
        if set(names) <= table.keys():
            values = [table[name][0] for name in names]
            return np.stack([_bytes(value) for value in values], axis=1)
    return None


def _bytes(values: np.ndarray) -> UInt8[np.ndarray, " rows"]:
    if values.dtype.kind == "f" and values.max(initial=0.0) <= 1.0:
        values = values * 255.0
    elif values.dtype.kind in "iu" and values.dtype.itemsize == 2:
        values = values / 257.0
    return np.rint(np.nan_to_num(values.astype(np.float64)).clip(0, 255)).astype(np.uint8)


def _lists(
    table: _Table, *names: str
) -> tuple[Int64[np.ndarray, " polygons"], Int64[np.ndarray, " n"]]:
    """Lengths and entries of the first of these lists that is there."""
    for name in names:
        values, counts = table.get(name, (None, None))
        if values is not None and counts is not None:
            if values.dtype.kind == "f" and not (values % 1 == 0).all():
                raise DamageError("a polygon names vertices by numbers that are not whole")
            return counts, values.astype(np.int64)
    return np.empty(0, np.int64), np.empty(0, np.int64)


def _strips(tables: dict[str, _Table]) -> Int64[np.ndarray, "triangles 3"]:
    """Triangles of all strips; -1 begins a new one."""
    found: list[np.ndarray] = [np.empty((0, 3), np.int64)]
    counts, corners = _lists(tables.get("tristrips", {}), "vertex_indices", "vertex_index")
    for strip in np.split(corners, np.cumsum(counts)[:-1]) if len(counts) else ():
        for piece in np.split(strip, np.flatnonzero(strip < 0)):
            own = piece[piece >= 0]
            if len(own) > 2:
                faces = np.stack([own[:-2], own[1:-1], own[2:]], axis=1)
                faces[1::2] = faces[1::2, ::-1]
                found.append(faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)])
    return np.concatenate(found)


def _places(
    faces: _Table,
    vertices: _Table,
    corners: Int64[np.ndarray, " n"],
    counts: Int64[np.ndarray, " polygons"],
    used: Int64[np.ndarray, "triangles 3"],
    strips: int,
) -> Float64[np.ndarray, "triangles 3 2"] | None:
    """Places on the picture, stated for the corners of polygons or for vertices."""
    lengths, values = None, faces.get("texcoord", (None, None))[0]
    if values is not None:
        lengths = faces["texcoord"][1]
    if strips:
        return None
    if values is not None and lengths is not None and (lengths == 2 * counts).all():
        uv = values.astype(np.float64).reshape(-1, 2)[used]
    else:
        pairs = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
        names = next((pair for pair in pairs if set(pair) <= vertices.keys()), None)
        if names is None:
            return None
        uv = np.stack([vertices[n][0].astype(np.float64) for n in names], 1)[corners[used]]
    return uv * [1.0, -1.0] + [0.0, 1.0]


def _of_faces(
    table: _Table,
    faces: Int64[np.ndarray, "faces 3"],
    of_face: Int64[np.ndarray, " faces"],
    count: int,
) -> UInt8[np.ndarray, "verts 3"] | None:
    """Colours of vertices as the mean of those of their triangles."""
    colours = _colours(table)
    if colours is None:
        return None
    own = np.repeat(colours[of_face].astype(np.float64), 3, axis=0)
    number = np.maximum(np.bincount(faces.ravel(), minlength=count), 1)
    sums = [np.bincount(faces.ravel(), own[:, k], minlength=count) for k in range(3)]
    return np.rint(np.stack(sums, axis=1) / number[:, None]).astype(np.uint8)
