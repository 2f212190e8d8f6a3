"""Arrays in a glTF file, as its accessors describe them (glTF 2.0, section 3.6)."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pygltflib import GLTF2, BufferView

from omomo_core.errors import InputError, reader_complaint

MAX_BYTES = 500 * 10**6
MAX_COUNT = 20_000_000

_DTYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


@dataclass(frozen=True)
class GltfFile:
    """The scene description, and the bytes of each buffer."""

    source: Path
    gltf: GLTF2
    buffers: tuple[bytes, ...]

    def array(self, index: int) -> np.ndarray:
        """Values of an accessor, (count, components); floats where they are normalised integers."""
        accessor = self.gltf.accessors[index]
        width, dtype = _WIDTHS[accessor.type], np.dtype(_DTYPES[accessor.componentType])
        count = accessor.count
        if not 0 <= count <= MAX_COUNT:
            raise ValueError(f"accessor {index} has {count} elements")
        if accessor.bufferView is None:
            values = np.zeros((count, width), dtype)
        else:
            values = self._view(accessor.bufferView, accessor.byteOffset, count, width, dtype)
        if accessor.sparse is not None:
            sparse = accessor.sparse
            at, new = sparse.indices, sparse.values
            kind = np.dtype(_DTYPES[at.componentType])
            places = self._view(at.bufferView, at.byteOffset, sparse.count, 1, kind)[:, 0]
            values = values.copy()
            values[places] = self._view(new.bufferView, new.byteOffset, sparse.count, width, dtype)
        if not accessor.normalized or dtype.kind == "f":
            return values
        return np.maximum(values / np.iinfo(dtype).max, -1.0)

    def _view(
        self, index: int, offset: int | None, count: int, width: int, dtype: np.dtype
    ) -> np.ndarray:
        view: BufferView = self.gltf.bufferViews[index]
        first = (view.byteOffset or 0) + (offset or 0)
        stride = view.byteStride or width * dtype.itemsize
        # numpy itself refuses to look beyond the end of the buffer.
        return np.ndarray(
            (count, width), dtype, self.buffers[view.buffer], first, (stride, dtype.itemsize)
        )


def open_gltf(path: Path) -> GltfFile:
    """Read a GLB, or a glTF with its data inside.

    Raises:
        InputError: "gltf-too-large", "gltf-external", "gltf-compressed" or "gltf-unreadable".
    """
    if path.stat().st_size > MAX_BYTES:
        raise InputError(
            "gltf-too-large",
            f"{path.name} has {path.stat().st_size / 1e6:.0f} MB; at most {MAX_BYTES / 1e6:.0f} "
            "are read.",
            where=str(path),
            fix="Export the moving object alone, without textures.",
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about chunks of extensions, which are skipped
            gltf = _parse(path.read_bytes())
        external = [b.uri for b in gltf.buffers if b.uri and not b.uri.startswith("data:")]
        buffers = () if external else tuple(_data(gltf, b.uri) for b in gltf.buffers)
    except Exception as problem:  # the decoders raise anything on a damaged file
        raise unreadable(path, problem) from None
    if external:
        raise InputError(
            "gltf-external",
            f"{path.name} keeps its data in another file: {str(external[0])[:60]}.",
            where=str(path),
            fix="Export as GLB: one file.",
        )
    packed = [e for e in gltf.extensionsRequired if "draco" in e or "meshopt" in e]
    if packed:
        raise InputError(
            "gltf-compressed",
            f"{path.name} is compressed ({', '.join(packed)}).",
            where=str(path),
            fix="Export it without compression.",
        )
    return GltfFile(path, gltf, buffers)


def unreadable(path: Path, problem: Exception) -> InputError:
    """The error for a file that violates the format."""
    return InputError(
        "gltf-unreadable",
        f"{path.name} cannot be read: {reader_complaint(problem)}.",
        where=str(path),
        fix="Open it in a 3D program and export it again as GLB.",
    )


def _parse(data: bytes) -> GLTF2:
    gltf = (
        GLTF2.load_from_bytes(data)
        if data.startswith(b"glTF")
        else GLTF2.from_json(data.decode("utf-8-sig"), infer_missing=True)
    )
    if gltf is None:
        raise ValueError("it has no scene")
    return gltf


def _data(gltf: GLTF2, uri: str | None) -> bytes:
    return gltf.decode_data_uri(uri) if uri else gltf.binary_blob() or b""
